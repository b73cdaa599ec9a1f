//! The robots of concealed recordings: nominal descriptions typed from data sheets, with plausible masses and motors.

use crate::lists::named;
use calib_foundation::description::{
    Coupling, DeclaredInertias, JointDescription, JointKind, RobotDescription,
};

named! {
    /// A robot that recordings are made of.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    Kind,
    /// All of them.
    ALL_KINDS: 4 {
        /// 210 kg, 6R, spherical wrist, joints 5 and 6 coupled.
        Sr210d "sr210d",
        /// 10 kg, desktop 6R, wrist of three offset axes.
        Compact6 "compact6",
        /// 12 kg, 7R, alternating axes.
        Seven7r "seven7r",
        /// 20 kg, 5R: base, shoulder, elbow, pitch and roll of the hand.
        Five5r "five5r",
    }
}

/// Those that recordings with effects of the library are made of.
pub(crate) const KINDS: [Kind; 3] = [Kind::Sr210d, Kind::Compact6, Kind::Seven7r];

/// Joint by joint: axis, point on it (mm), mass (kg), its centre (mm), gear, Nm/A, range of measurement (deg).
type Row = ([f64; 3], [f64; 3], f64, [f64; 3], f64, f64, [f64; 2]);

/// Joints, tool (mm), payload (kg), its centre from the tool (mm), least height and distance of the tool (mm), reach (m).
type Sheet = (&'static [Row], [f64; 3], f64, [f64; 3], [f64; 2], f64);

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const DOWN_Y: [f64; 3] = [0.0, -1.0, 0.0];
const DOWN_Z: [f64; 3] = [0.0, 0.0, -1.0];

#[rustfmt::skip]
const SR210D: [Row; 6] = [
    (Z, [0.0, 0.0, 0.0], 340.0, [150.0, 0.0, -120.0], 213.0, 1.2, [-120.0, 120.0]),
    (DOWN_Y, [312.0, 0.0, 0.0], 290.0, [312.0, 60.0, 460.0], 214.0, 1.2, [-50.0, 75.0]),
    (DOWN_Y, [312.0, 0.0, 1075.0], 220.0, [420.0, 0.0, 1290.0], 203.0, 1.1, [-65.0, 60.0]),
    (X, [312.0, 0.0, 1310.0], 85.0, [1050.0, 0.0, 1310.0], 192.0, 0.85, [-160.0, 160.0]),
    (DOWN_Y, [1594.0, 0.0, 1310.0], 42.0, [1620.0, 0.0, 1310.0], 178.0, 0.75, [-110.0, 110.0]),
    (X, [1594.0, 0.0, 1310.0], 14.0, [1774.0, 0.0, 1310.0], 117.0, 0.75, [-170.0, 170.0]),
];

#[rustfmt::skip]
const COMPACT6: [Row; 6] = [
    (Z, [0.0, 0.0, 0.0], 7.2, [0.0, 8.0, 105.0], 101.0, 0.12, [-170.0, 170.0]),
    (Y, [0.0, 0.0, 127.3], 12.8, [230.0, 135.0, 127.3], 101.0, 0.12, [-150.0, -20.0]),
    (Y, [612.0, 0.0, 127.3], 3.9, [838.0, 38.0, 127.3], 101.0, 0.1, [-140.0, 140.0]),
    (Y, [1184.3, 0.0, 127.3], 1.9, [1184.3, 100.0, 122.0], 101.0, 0.09, [-170.0, 170.0]),
    (DOWN_Z, [1184.3, 163.9, 127.3], 1.9, [1184.3, 163.9, 48.0], 101.0, 0.09, [-170.0, 170.0]),
    (Y, [1184.3, 163.9, 11.6], 0.4, [1184.3, 222.0, 11.6], 101.0, 0.09, [-170.0, 170.0]),
];

#[rustfmt::skip]
const SEVEN7R: [Row; 7] = [
    (Z, [0.0, 0.0, 0.0], 5.1, [0.0, -20.0, 175.0], 160.0, 0.15, [-160.0, 160.0]),
    (Y, [0.0, 0.0, 340.0], 4.8, [0.0, 30.0, 405.0], 160.0, 0.15, [-110.0, 110.0]),
    (Z, [0.0, 0.0, 540.0], 4.1, [0.0, 20.0, 585.0], 160.0, 0.13, [-160.0, 160.0]),
    (DOWN_Y, [0.0, 0.0, 740.0], 3.9, [0.0, -25.0, 805.0], 160.0, 0.13, [-110.0, 110.0]),
    (Z, [0.0, 0.0, 940.0], 2.9, [0.0, -15.0, 945.0], 100.0, 0.1, [-160.0, 160.0]),
    (Y, [0.0, 0.0, 1140.0], 2.4, [0.0, 0.0, 1152.0], 160.0, 0.1, [-110.0, 110.0]),
    (Z, [0.0, 0.0, 1266.0], 0.6, [0.0, 0.0, 1266.0], 160.0, 0.1, [-165.0, 165.0]),
];

#[rustfmt::skip]
const FIVE5R: [Row; 5] = [
    (Z, [0.0, 0.0, 0.0], 62.0, [90.0, 0.0, 260.0], 141.0, 0.4, [-165.0, 165.0]),
    (Y, [160.0, 0.0, 430.0], 34.0, [180.0, 40.0, 690.0], 161.0, 0.4, [-60.0, 80.0]),
    (Y, [160.0, 0.0, 1030.0], 21.0, [330.0, -20.0, 1090.0], 141.0, 0.35, [-80.0, 65.0]),
    (Y, [860.0, 0.0, 1130.0], 7.5, [905.0, 0.0, 1130.0], 101.0, 0.22, [-115.0, 115.0]),
    (X, [860.0, 0.0, 1130.0], 2.1, [975.0, 0.0, 1130.0], 81.0, 0.2, [-170.0, 170.0]),
];

impl Kind {
    #[rustfmt::skip]
    fn sheet(self) -> Sheet {
        match self {
            Kind::Sr210d => (&SR210D, [1854.0, 0.0, 1310.0], 210.0, [170.0, 35.0, 55.0], [-200.0, 500.0], 2.7),
            Kind::Compact6 => (&COMPACT6, [1184.3, 256.0, 11.6], 10.0, [20.0, 55.0, -12.0], [20.0, 150.0], 1.3),
            Kind::Seven7r => (&SEVEN7R, [0.0, 0.0, 1296.0], 12.0, [12.0, 10.0, 40.0], [50.0, 100.0], 0.95),
            Kind::Five5r => (&FIVE5R, [1010.0, 0.0, 1130.0], 20.0, [45.0, 15.0, -20.0], [50.0, 200.0], 1.6),
        }
    }

    /// The nominal robot; `aside` moves the measured point off the last axis, mm.
    pub fn description(self, aside: [f64; 3]) -> RobotDescription {
        let (rows, tool, payload, offset, ..) = self.sheet();
        let metres = |v: [f64; 3]| v.map(|x| 1e-3 * x);
        let joints = rows.iter().enumerate().map(
            |(index, (axis, point, mass, centre, gear, constant, range))| JointDescription {
                name: format!("J{}", index + 1),
                kind: JointKind::Revolute,
                axis: *axis,
                point: metres(*point),
                limits: Some(range.map(f64::to_radians)),
                reduction_ratio: Some(*gear),
                motor_constant: Some(*constant),
                mass: Some(*mass),
                centre: Some(metres(*centre)),
                coulomb: None,
            },
        );
        let point: [f64; 3] = std::array::from_fn(|i| tool[i] + aside[i]);
        let coupled = matches!(self, Kind::Sr210d).then_some(Coupling {
            moved: 5,
            by: 4,
            ratio: 0.0,
        });
        RobotDescription {
            name: self.name().into(),
            joints: joints.collect(),
            tool: metres(point),
            tool_rotation: [X, Y, Z],
            couplings: coupled.into_iter().collect(),
            payload_mass: payload,
            payload_centre: metres(std::array::from_fn(|i| point[i] + offset[i])),
            gravity: [0.0, 0.0, -9.81],
            inertias: DeclaredInertias::default(),
            tolerances: Default::default(),
        }
    }

    /// Lowest height of a joint and of the tool, and least distance of the tool from the first axis, mm.
    pub fn room_mm(self) -> [f64; 2] {
        self.sheet().4
    }

    /// How far the measured point gets from the first axis, about, m.
    pub fn reach_m(self) -> f64 {
        self.sheet().5
    }
}
