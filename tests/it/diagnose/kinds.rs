//! Causes are named from whatever was measured: a level's inclinations, distances from anchors, points beside distances. The twin conceals them.

use super::Named;
use crate::compensate::true_error::physics;
use crate::fixture::question;
use crate::identify::normal;
use crate::twin::sr210d;
use calib::description::RobotDescription;
use calib::diagnose::{Diagnosis, Question, VerdictKind, diagnose, wrong_setup};
use calib::estimate::gauge;
use calib::observation::Dimension;
use calib::robot::{Measurements, Named as Names, NoiseBasis, PointReadings, Readings, RobotModel};
use calib::twin::effect::Physical;
use calib::twin::plan::GivenPose;
use calib::twin::plan::{Block, Climate, Poses};
use calib::twin::recorder::{Experiment, Motors, Shot};
use calib::twin::tracker::Tracker;
use calib::twin::truth::{LinkError, TrueRobot};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

/// rad
const SIGMA_TILT: f64 = 1.5e-5;
/// m
const SIGMA_WIRE: f64 = 1.5e-5;
const SIGMA_POINT: f64 = 4e-5;
/// Of focal lengths: an arc second.
const SIGMA_IMAGE: f64 = 5e-6;
/// m: how far points stand apart that show how the last body is turned.
const APART: f64 = 0.5;

/// deg: where a level on the tool stands upright more often than not.
const UPRIGHT: [[f64; 2]; 6] = [
    [-90.0, 90.0],
    [-60.0, 40.0],
    [-50.0, 60.0],
    [-90.0, 90.0],
    [-90.0, 90.0],
    [-120.0, 120.0],
];

/// A wave of a gear, a spring and a gap, each at a joint.
struct Causes {
    gear: (usize, f64, f64, f64),
    spring: (usize, f64),
    play: (usize, f64),
}

impl Causes {
    fn physics(&self) -> Vec<Physical> {
        let (g, order, arcsec, phase) = self.gear;
        let ((s, rad_per_nm), (p, gap)) = (self.spring, self.play);
        physics(&format!(
            "[{{gear_cyclic: {{joint: {g}, order: {order}, amplitude_arcsec: {arcsec}, phase_deg: {phase}}}}}, \
             {{joint_compliance: {{joint: {s}, rad_per_nm: {rad_per_nm:e}}}}}, \
             {{backlash: {{joint: {p}, gap_arcsec: {gap}}}}}]"
        ))
    }
    fn named(&self) -> Named {
        [
            ("gear_cyclic", self.gear.0),
            ("joint_compliance", self.spring.0),
            ("backlash", self.play.0),
        ]
        .map(|(effect, joint)| (effect.to_string(), format!("joint {joint}")))
        .into()
    }
}

/// What the twin's arm did, without noise.
struct Recorded {
    robot: RobotDescription,
    /// Rows without anything measured.
    rows: Measurements,
    /// m, tracker frame.
    point: Vec<Vector3<f64>>,
    /// Of the last body.
    turn: Vec<Matrix3<f64>>,
}

/// Poses under two payloads, with the arm off nominal as it is made.
fn recorded(
    effects: &[Physical],
    points: usize,
    range_deg: &[[f64; 2]],
    repeatability_arcsec: f64,
) -> Recorded {
    let robot = sr210d();
    let joints = robot.joints.len();
    let link = |link: usize| LinkError {
        link,
        shift_mm: [0, 1, 2].map(|axis| 0.3 * normal(71 * link + axis)),
        tilt_arcsec: match link == joints {
            true => [0.0; 3],
            false => [3, 4, 5].map(|axis| 60.0 * normal(71 * link + axis)),
        },
    };
    let truth = TrueRobot {
        links: (1..=joints).map(link).collect(),
        offset_deg: (0..joints)
            .map(|joint| 0.02 * normal(977 + joint))
            .collect(),
        ..TrueRobot::default()
    };
    let seen = |robot: &RobotDescription, blocks: &[Block]| -> Vec<Shot> {
        let tracker = Tracker {
            noise_um: 0.0,
            noise_um_per_m: 0.0,
            ..Tracker::default()
        };
        let poses = Poses {
            range_deg: range_deg.to_vec(),
            ..Poses::default()
        };
        let experiment = Experiment {
            robot,
            truth: &truth,
            effects,
            tracker: &tracker,
            motors: &Motors::default(),
            repeatability_arcsec: &vec![repeatability_arcsec; joints],
            poses: &poses,
            blocks,
            climate: &Climate::default(),
            seed: 11,
        };
        experiment.record(|| ()).unwrap()
    };
    let drawn = [0.0, 120.0].map(|payload_kg| Block {
        points: points / 2,
        payload_kg,
        ..Block::default()
    });
    let shots = seen(&robot, &drawn);
    let given = |shot: &Shot| GivenPose {
        joints_deg: shot.q.iter().map(|q| q.to_degrees()).collect(),
        direction: Vec::new(),
        payload_kg: None,
    };
    let again = [0, 1].map(|block| Block {
        points: 0,
        given: shots
            .iter()
            .filter(|shot| shot.block == block)
            .map(given)
            .collect(),
        ..drawn[block].clone()
    });
    let [plain, x, y, z] = [None, Some(0), Some(1), Some(2)].map(|axis: Option<usize>| {
        let mut moved = robot.clone();
        axis.iter().for_each(|axis| moved.tool[*axis] += APART);
        seen(&moved, &again)
    });
    let at = |shots: &[Shot], row: usize| Vector3::from(shots[row].position);
    let turn = |row: usize| {
        Matrix3::from_columns(&[&x, &y, &z].map(|moved| (at(moved, row) - at(&plain, row)) / APART))
    };
    let rows = plain.len();
    Recorded {
        rows: Measurements {
            joints,
            q: plain.iter().flat_map(|shot| shot.q.clone()).collect(),
            points: PointReadings::none(rows),
            payload: plain.iter().map(|shot| shot.payload_kg).collect(),
            time: Some(plain.iter().map(|shot| shot.time_s).collect()),
            direction: Some(
                plain
                    .iter()
                    .flat_map(|shot| shot.direction.clone())
                    .collect(),
            ),
            noise_basis: NoiseBasis::Instrument,
            ..Measurements::default()
        },
        point: (0..rows).map(|row| at(&plain, row)).collect(),
        turn: (0..rows).map(turn).collect(),
        robot,
    }
}

impl Recorded {
    /// Adds what a level on the tool reads where it stands upright.
    fn with_a_level(self) -> Self {
        self.read("inclination", SIGMA_TILT, None, |all, row| {
            let turn = &all.turn[row];
            let tilt = |axis: usize| match turn[(2, 2)] > 0.3 {
                true => turn[(2, axis)].asin() + SIGMA_TILT * normal(2 * row + axis),
                false => f64::NAN,
            };
            [0, 1].map(tilt).to_vec()
        })
    }

    /// Adds distances from four draw-wires in turn.
    fn with_wires(self) -> Self {
        let anchors: [Vector3<f64>; 4] = [
            [3.0, 1.0, 0.0],
            [5.5, -2.5, 0.1],
            [3.0, -3.0, 2.0],
            [6.0, 0.5, 2.5],
        ]
        .map(Vector3::from);
        let names = ["A", "B", "C", "D"];
        let anchor = Names::of((0..self.point.len()).map(|row| names[row % 4]));
        self.read("distance", SIGMA_WIRE, Some(anchor), |all, row| {
            let length = (all.point[row] - anchors[row % 4]).norm();
            vec![length + SIGMA_WIRE * normal(50_000 + row)]
        })
    }

    /// Seen by one camera some way off, which is the recording's origin.
    fn with_a_camera(self) -> Self {
        let centre = self.point.iter().sum::<Vector3<f64>>() / self.point.len() as f64;
        let away = Vector3::new(4.0, -4.0, 3.0);
        let along = -away.normalize();
        let right = along.cross(&Vector3::z()).normalize();
        let down = along.cross(&right);
        self.read("planar", SIGMA_IMAGE, None, |all, row| {
            let point = all.point[row] - centre - away;
            let image = |axis: usize| {
                [right, down][axis].dot(&point) / along.dot(&point)
                    + SIGMA_IMAGE * normal(30_000 + 2 * row + axis)
            };
            [0, 1].map(image).to_vec()
        })
    }

    /// Adds points of every other row, by a coarse tracker.
    fn with_some_points(mut self) -> Self {
        for row in (0..self.point.len()).step_by(2) {
            self.rows.points.position[row] = self.point[row]
                + Vector3::from_fn(|axis, _| SIGMA_POINT * normal(90_000 + 3 * row + axis));
            self.rows.points.sigma[row] = Vector3::repeat(SIGMA_POINT);
        }
        self
    }

    /// Adds what a kind of instrument reads of every row.
    fn read(
        mut self,
        kind: &'static str,
        sigma: f64,
        anchor: Option<Names>,
        values: impl Fn(&Self, usize) -> Vec<f64>,
    ) -> Self {
        let rows = self.point.len();
        self.rows.readings.push(Readings {
            kind,
            width: values(&self, 0).len(),
            values: (0..rows).flat_map(|row| values(&self, row)).collect(),
            sigma: vec![sigma; rows],
            anchor,
        });
        self
    }

    /// Diagnosed on four of five measured rows; what is said, and whether a wrong set-up is.
    fn diagnosed(&self) -> Diagnosis {
        let data = &self.rows;
        let measured = (0..data.rows()).filter(|row| calib::observation::values(data, *row) > 0);
        let (validate, fit): (Vec<usize>, Vec<usize>) = measured.partition(|row| *row % 5 == 4);
        let (robot, _) = gauge(
            RobotModel::new(self.robot.clone()),
            data,
            &fit,
            &BTreeMap::new(),
        )
        .unwrap();
        let question = Question {
            validate: &validate,
            seed: 7,
            ..question(&robot, data, &fit)
        };
        assert!(wrong_setup(&question).is_none());
        diagnose(&question, |_| ())
    }
}

/// Names and places found are those concealed, and what is left is noise.
fn explains(diagnosis: &Diagnosis, concealed: &Named) {
    let findings = diagnosis.findings.iter();
    let found = findings.map(|finding| (finding.effect.to_string(), finding.place.to_string()));
    let statements = diagnosis.findings.iter().map(|finding| &finding.statement);
    assert_eq!(
        &found.collect::<Named>(),
        concealed,
        "{}: {:#?}",
        diagnosis.statement,
        statements.collect::<Vec<_>>()
    );
    // A noise that is taken from what is left explains nothing.
    let inferred = diagnosis.noise_basis == NoiseBasis::Inferred;
    let verdict = match inferred {
        true => VerdictKind::Unexplained,
        false => VerdictKind::Explained,
    };
    assert_eq!(diagnosis.verdict, verdict, "{}", diagnosis.statement);
    let (before, after) = (diagnosis.before.unwrap().rms, diagnosis.after.unwrap().rms);
    assert!(
        after < 0.5 * before && (0.7..1.3).contains(&(after / diagnosis.noise_floor)),
        "{before:e} {after:e} {:e}",
        diagnosis.noise_floor
    );
}

#[test]
fn causes_are_named_from_every_kind_of_measurement() {
    type Seen = fn(Recorded) -> Recorded;
    let (level, wires, camera): (Seen, Seen, Seen) = (
        Recorded::with_a_level,
        Recorded::with_wires,
        Recorded::with_a_camera,
    );
    let both: Seen = |recorded| recorded.with_wires().with_some_points();
    let causes = |gear, spring, play| Causes { gear, spring, play };
    let first = causes((2, 3.0, 60.0, 25.0), (3, 2.5e-7), (5, 70.0));
    let second = causes((3, 2.0, 60.0, 80.0), (2, 2.5e-7), (4, 70.0));
    let third = causes((1, 2.0, 40.0, 70.0), (2, 2e-7), (3, 60.0));
    let fourth = causes((4, 2.0, 60.0, 10.0), (2, 2e-7), (1, 50.0));
    let fifth = causes((3, 2.0, 60.0, 40.0), (2, 2e-7), (1, 50.0));
    let (angle, length) = (Some(Dimension::Angle), Some(Dimension::Length));
    for (causes, count, given, play_arcsec, seen, dimension) in [
        (first, 700, &UPRIGHT[..], 0.0, level, angle),
        (second, 700, &UPRIGHT, 4.0, level, angle),
        (third, 480, &[], 1.5, wires, length),
        (fourth, 240, &[], 2.0, both, None),
        (fifth, 480, &[], 0.0, camera, angle),
    ] {
        let diagnosis = seen(recorded(&causes.physics(), count, given, play_arcsec)).diagnosed();
        explains(&diagnosis, &causes.named());
        assert!(dimension.is_none_or(|dimension| diagnosis.dimension == dimension));
        let in_angles =
            diagnosis.statement.contains("arcsec") && !diagnosis.statement.contains(" um");
        assert!(count < 700 || in_angles, "{}", diagnosis.statement);
        // How well joints repeat is seen, too.
        let repeatability = diagnosis.repeatability.sigma.to_degrees() * 3600.0;
        assert!(
            play_arcsec < 3.0 || (3.0..5.2).contains(&repeatability),
            "{repeatability} arcsec"
        );
    }
}
