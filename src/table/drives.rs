//! The verdict of a diagnosis of commands and responses, with errors before and after: noise and errors of the simulated angle of each joint, the numbers of the simulation before and after, and what it does along the
//! commands. Its findings, numbers and rivals are tables that other diagnoses have, too.

use super::findings::{beside_findings, ranked};
use super::motion::of_joints;
use super::{
    DriveSimulation, DriveSimulationRow, DriveVerdict, DriveVerdictRow, FindingNumberRow,
    FindingNumbers, FindingRow, Findings, JointDriveRow, JointDrives, RivalRow, Rivals, Table,
};
use crate::diagnose::VerdictKind;
use crate::dynamics::Inertial;
use crate::error::Result;
use crate::store::frame::{Cell, Frame, FrameBuilder};
use calib_drives::mjcf::MjcfArm;
use calib_drives::physics::{Curve, Joint, Over, Physics};
use calib_drives::recording::Recording;
use calib_drives::{DriveDiagnosis, Drives};
use std::borrow::Cow;

beside_findings! { DriveDiagnosis => FindingNumbers::of_drives of FindingNumberRow, Rivals::of_drives of RivalRow }

impl Findings {
    /// A row for each finding of drives.
    pub fn of_drives(diagnosis: &DriveDiagnosis) -> Self {
        let rows = ranked(&diagnosis.findings).map(|(rank, finding)| FindingRow {
            rank,
            effect: finding.effect.clone().into(),
            place: finding.place.clone(),
            follows: Some(finding.follows.into()),
            statement: finding.statement.clone(),
            delta_bic: Some(finding.delta_bic),
            effect_rms_rad: Some(finding.effect_rms),
            probability: Some(finding.probability),
            place_probability: Some(finding.place_probability),
            none_probability: Some(finding.none_probability),
            forms: "[]".into(),
            ..FindingRow::default()
        });
        Self(rows.collect())
    }
}

impl DriveVerdict {
    /// The verdict of the stage `step`.
    pub fn of(step: &str, diagnosis: &DriveDiagnosis) -> Self {
        let kind = match (diagnosis.explained, diagnosis.findings.is_empty()) {
            (true, true) => VerdictKind::NothingMissing,
            (true, false) => VerdictKind::Explained,
            (false, _) => VerdictKind::Unexplained,
        };
        let error = &diagnosis.overall;
        let mrad = |rad: f64| 1e3 * rad;
        let statement = format!(
            "Simulated angles differ from measured ones by {:.3} mrad rms, with the findings by {:.3} mrad; the noise is {:.3} mrad.",
            mrad(error.held_out[0]),
            mrad(error.held_out[1]),
            mrad(error.noise)
        );
        Self(vec![DriveVerdictRow {
            step: step.into(),
            verdict: kind.name().into(),
            statement,
            rows: diagnosis.rows as i64,
            held_out: diagnosis.held_out,
            noise_rad: error.noise,
            before_rms_rad: error.held_out[0],
            after_rms_rad: error.held_out[1],
            before_fitted_rms_rad: error.fitted[0],
            after_fitted_rms_rad: error.fitted[1],
        }])
    }
}

impl JointDrives {
    /// A row for each joint.
    pub fn of(diagnosis: &DriveDiagnosis) -> Self {
        let rows = (1..).zip(&diagnosis.joints);
        let rows = rows.map(|(joint, error)| JointDriveRow {
            joint,
            noise_rad: error.noise,
            before_rms_rad: error.held_out[0],
            after_rms_rad: error.held_out[1],
            leftover_over_noise: error.over_noise,
        });
        Self(rows.collect())
    }
}

/// A quantity with its unit, and its value.
type Quantity = (Cow<'static, str>, &'static str, f64);

fn named(all: impl IntoIterator<Item = (&'static str, &'static str, f64)>) -> Vec<Quantity> {
    let all = all.into_iter();
    all.map(|(name, unit, value)| (name.into(), unit, value))
        .collect()
}

/// Numbers of a joint's drive and friction.
fn of_joint(joint: &Joint) -> Vec<Quantity> {
    let mut all = named([
        ("kp", "Nm/rad", joint.kp),
        ("kd", "Nm s/rad", joint.kd),
        ("kd_on_error", "1", f64::from(u8::from(joint.kd_on_error))),
        ("torque_limit", "Nm", joint.limit),
        ("command_offset", "rad", joint.offset),
        ("command_delay", "s", joint.delay),
        ("dead_band", "rad", joint.dead_band),
        ("speed_limit", "rad/s", joint.speed_limit),
        ("integral_gain", "Nm/(rad s)", joint.integral[0]),
        ("integral_limit", "Nm", joint.integral[1]),
        ("integral_start", "Nm", joint.integral_start),
        ("damping", "Nm s/rad", joint.damping),
        ("friction", "Nm", joint.friction),
        ("stribeck_friction", "Nm", joint.stribeck[0]),
        ("stribeck_speed", "rad/s", joint.stribeck[1]),
        ("load_friction_driving", "1", joint.load_friction[0]),
        ("load_friction_back", "1", joint.load_friction[1]),
        ("gear_friction_driving", "1", joint.gear_friction[0]),
        ("gear_friction_back", "1", joint.gear_friction[1]),
        ("presliding", "rad", joint.presliding),
        ("warm_up_share", "1", joint.warm_up[0]),
        ("warm_up_share_viscous", "1", joint.warm_up_viscous),
        ("warm_up_time", "s", joint.warm_up[1]),
        ("armature", "kg m2", joint.armature),
        ("spring_stiffness", "Nm/rad", joint.spring[0]),
        ("spring_reference", "rad", joint.spring[1]),
    ]);
    if let Some(gear) = &joint.gear {
        all.extend(named([
            ("gear_stiffness", "Nm/rad", gear.stiffness),
            ("gear_damping", "Nm s/rad", gear.damping),
            ("gear_play", "rad", gear.play),
            (
                "gear_encoder_on_link",
                "1",
                f64::from(u8::from(gear.encoder_on_link)),
            ),
        ]));
    }
    for (k, wave) in (1..).zip(&joint.ripple) {
        let parts = RIPPLE.into_iter().zip(["1", "Nm", "Nm"]).zip(wave);
        all.extend(parts.map(|((part, unit), value)| (ripple(k, part).into(), unit, *value)));
    }
    for (by, share) in &joint.coupling {
        all.push((coupling(*by).into(), "1", *share));
    }
    for curve in &joint.curves {
        let name = curve_name(curve.over, curve.dry);
        let [first, step] = curve.knots;
        let unit = match curve.over {
            Over::Angle(_) => "rad",
            Over::Speed(_) | Over::Velocity(_) => "rad/s",
            Over::Acceleration(_) => "rad/s2",
            Over::Time => "s",
        };
        all.push((format!("{name}_from").into(), unit, first));
        all.push((format!("{name}_step").into(), unit, step));
        let values = curve.values.iter().enumerate();
        all.extend(values.map(|(k, value)| (format!("{name}_{k}").into(), "Nm", *value)));
    }
    all
}

const RIPPLE: [&str; 3] = ["waves", "cosine", "sine"];

fn ripple(number: usize, part: &str) -> String {
    format!("ripple{number}_{part}")
}

fn coupling(by: usize) -> String {
    format!("share_of_drive{}", by + 1)
}

/// What a curve is called, joints from 1.
fn curve_name(over: Over, dry: bool) -> String {
    let what = if dry { "friction" } else { "torque" };
    match over {
        Over::Angle(by) => format!("{what}_over_angle{}", by + 1),
        Over::Speed(by) => format!("{what}_over_speed{}", by + 1),
        Over::Velocity(by) => format!("{what}_over_velocity{}", by + 1),
        Over::Acceleration(by) => format!("{what}_over_acceleration{}", by + 1),
        Over::Time => format!("{what}_over_time"),
    }
}

fn of_link(body: &Inertial) -> Vec<Quantity> {
    let (c, i) = (body.centre, body.inertia);
    named([
        ("mass", "kg", body.mass),
        ("centre_x", "m", c.x),
        ("centre_y", "m", c.y),
        ("centre_z", "m", c.z),
        ("ixx", "kg m2", i[(0, 0)]),
        ("iyy", "kg m2", i[(1, 1)]),
        ("izz", "kg m2", i[(2, 2)]),
        ("ixy", "kg m2", i[(0, 1)]),
        ("ixz", "kg m2", i[(0, 2)]),
        ("iyz", "kg m2", i[(1, 2)]),
    ])
}

fn of_arm(physics: &Physics) -> Vec<Quantity> {
    let (g, tool) = (physics.bodies.gravity, physics.tool);
    named([
        ("gravity_x", "m/s2", g.x),
        ("gravity_y", "m/s2", g.y),
        ("gravity_z", "m/s2", g.z),
        ("tool_x", "m", tool.x),
        ("tool_y", "m", tool.y),
        ("tool_z", "m", tool.z),
        ("command_hold", "s", physics.hold),
        ("voltage_sag", "1/Nm", physics.sag),
    ])
}

impl DriveSimulation {
    /// The simulation of an arm, as it is and with the findings.
    pub fn of(arm: &MjcfArm, drives: &Drives, diagnosis: &DriveDiagnosis) -> Self {
        let mut rows = Vec::new();
        let mut push = |part: &str, number: usize, before: Vec<Quantity>, after: Vec<Quantity>| {
            let name = match number {
                0 => "",
                _ => arm.joints[number - 1].name.as_str(),
            };
            let finite = |value: f64| Some(value).filter(|value| value.is_finite());
            for (quantity, unit, value) in after {
                let believed = before.iter().find(|(name, ..)| *name == quantity);
                rows.push(DriveSimulationRow {
                    part: part.into(),
                    number: number as i64,
                    name: name.into(),
                    quantity: quantity.clone().into_owned(),
                    unit: unit.into(),
                    believed: believed.and_then(|(.., value)| finite(*value)),
                    value: finite(value),
                });
            }
        };
        let (base, found) = (&drives.base, &diagnosis.physics);
        let rate = named([("command_rate", "Hz", 1.0 / drives.recording.period)]);
        push("arm", 0, rate.clone(), rate);
        push("arm", 0, of_arm(base), of_arm(found));
        for joint in 0..base.joints.len() {
            let (axis, point) = (arm.arm.axes[joint], arm.arm.points[joint]);
            let prismatic = f64::from(u8::from(arm.arm.prismatic[joint]));
            let place = named([
                ("slides", "1", prismatic),
                ("reference", "rad", arm.joints[joint].reference),
                ("axis_x", "1", axis.x),
                ("axis_y", "1", axis.y),
                ("axis_z", "1", axis.z),
                ("point_x", "m", point.x),
                ("point_y", "m", point.y),
                ("point_z", "m", point.z),
            ]);
            push("joint", joint + 1, place.clone(), place);
            let (before, after) = (&base.joints[joint], &found.joints[joint]);
            push("joint", joint + 1, of_joint(before), of_joint(after));
            let (before, after) = (&base.bodies.links[joint], &found.bodies.links[joint]);
            push("link", joint + 1, of_link(before), of_link(after));
        }
        Self(rows)
    }

    /// A number of it, with the findings; none where it is not there or nothing limits.
    pub fn value(&self, part: &str, number: usize, quantity: &str) -> Option<f64> {
        let is_it = |row: &&DriveSimulationRow| {
            row.part == part && row.number == number as i64 && row.quantity == quantity
        };
        self.0.iter().find(is_it)?.value
    }

    /// Ripples of a joint (from 1): waves a turn, Nm of cosine and sine.
    pub fn ripples(&self, joint: usize) -> Vec<[f64; 3]> {
        let wave = |number: usize| {
            let part = |k: usize| self.value("joint", joint, &ripple(number, RIPPLE[k]));
            Some([part(0)?, part(1)?, part(2)?])
        };
        (1..).map_while(wave).collect()
    }

    /// Drives whose torque is felt at a joint (from 1): which (from 0), and the share of it.
    pub fn couplings(&self, joint: usize) -> Vec<(usize, f64)> {
        let drives = 0..self.joints().len();
        let share = |by: usize| Some((by, self.value("joint", joint, &coupling(by))?));
        drives.filter_map(share).collect()
    }

    /// Curves of a joint (from 1).
    pub fn curves(&self, joint: usize) -> Vec<Curve> {
        let of = |by: usize| {
            [
                Over::Angle(by),
                Over::Speed(by),
                Over::Velocity(by),
                Over::Acceleration(by),
            ]
        };
        let all = (0..self.joints().len()).flat_map(of).chain([Over::Time]);
        let all = all.flat_map(|over| [(over, false), (over, true)]);
        let curve = |(over, dry): (Over, bool)| {
            let name = curve_name(over, dry);
            let value = |part: String| self.value("joint", joint, &format!("{name}_{part}"));
            Some(Curve {
                over,
                knots: [value("from".into())?, value("step".into())?],
                values: (0..).map_while(|k: usize| value(k.to_string())).collect(),
                dry,
            })
        };
        all.filter_map(curve).collect()
    }

    /// Names of the joints, in the order of the chain.
    pub fn joints(&self) -> Vec<&str> {
        let is_one = |row: &&DriveSimulationRow| row.part == "joint" && row.quantity == "kp";
        let mut rows: Vec<_> = self.0.iter().filter(is_one).collect();
        rows.sort_by_key(|row| row.number);
        rows.into_iter().map(|row| row.name.as_str()).collect()
    }
}

/// Rows of a course at most.
const MOST_ROWS: usize = 20_000;

/// What was commanded, measured and simulated; key `sequence`. Angles are rad, row-major (`row * joints + joint`).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DriveCourse {
    /// Number of joints.
    pub joints: usize,
    /// Number of the row, from 1.
    pub sequence: Vec<i64>,
    /// s.
    pub time: Vec<f64>,
    /// Whether nothing was fitted to the row.
    pub held_out: Vec<bool>,
    /// As commanded.
    pub command: Vec<f64>,
    /// As measured.
    pub measured: Vec<f64>,
    /// Of the simulation as it is.
    pub simulated: Vec<f64>,
    /// Of the simulation with the findings.
    pub corrected: Vec<f64>,
}

impl DriveCourse {
    /// The courses of a diagnosis; of long recordings every so many rows.
    pub fn of(recording: &Recording, diagnosis: &DriveDiagnosis) -> Self {
        let n = recording.joints();
        let every = recording.rows().div_ceil(MOST_ROWS).max(1);
        let rows: Vec<usize> = (0..recording.rows()).step_by(every).collect();
        let kept = |all: &[f64]| -> Vec<f64> {
            let of_row = |row: &usize| all[row * n..(row + 1) * n].to_vec();
            rows.iter().flat_map(of_row).collect()
        };
        let held_out = |row: &usize| recording.held_out[*row];
        Self {
            joints: n,
            sequence: rows.iter().map(|row| *row as i64).collect(),
            time: rows.iter().map(|row| recording.time[*row]).collect(),
            held_out: rows.iter().map(held_out).collect(),
            command: kept(&recording.command),
            measured: kept(&recording.angle),
            simulated: kept(&diagnosis.angles[0]),
            corrected: kept(&diagnosis.angles[1]),
        }
    }

    fn columns(&self) -> [(&'static str, &Vec<f64>); 4] {
        [
            ("command{j}_rad", &self.command),
            ("measured{j}_rad", &self.measured),
            ("simulated{j}_rad", &self.simulated),
            ("corrected{j}_rad", &self.corrected),
        ]
    }
}

impl Table for DriveCourse {
    const KIND: &'static str = "drive_course";

    fn to_frame(&self) -> Result<Frame> {
        let mut frame = FrameBuilder::new(Self::KIND);
        frame.push("sequence", Cell::to_array(self.sequence.clone()));
        frame.push("time_s", Cell::to_array(self.time.clone()));
        frame.push("held_out", Cell::to_array(self.held_out.clone()));
        for (name, all) in self.columns() {
            for joint in 0..self.joints {
                let name = name.replace("{j}", &(joint + 1).to_string());
                let of_joint = all.iter().skip(joint).step_by(self.joints).copied();
                frame.push(name, Cell::to_array(of_joint.collect()));
            }
        }
        frame.finish()
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let joints = (1..)
            .take_while(|joint| frame.column(&format!("measured{joint}_rad")).is_some())
            .count();
        let all = |name: &str| of_joints::<f64>(frame, name, joints);
        Ok(Self {
            joints,
            sequence: frame.read("sequence")?,
            time: frame.read("time_s")?,
            held_out: frame.read("held_out")?,
            command: all("command{j}_rad")?,
            measured: all("measured{j}_rad")?,
            simulated: all("simulated{j}_rad")?,
            corrected: all("corrected{j}_rad")?,
        })
    }
}
