//! An arm that moves: joints and their torques or motor currents, in the order of time. SI in Rust, mm and rad in the table.

use crate::Table;
use crate::dynamics::TorqueDiagnosis;
use crate::error::Result;
use crate::recording::{declared, interleaved, numbers, prismatic, push_numbers};
use crate::store::frame::{Cell, Frame, FrameBuilder};
use crate::units::Unit;
use std::collections::BTreeMap;

/// Rows in the order of time; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ArmMotion {
    /// Number of joints.
    pub joints: usize,
    /// Which joints slide.
    pub prismatic: Vec<bool>,
    /// From 1.
    pub sequence: Vec<i64>,
    /// Stretch of the recording, from 1.
    pub trajectory: Vec<i64>,
    /// What rows may be for.
    pub usages: Vec<String>,
    /// Which of [`ArmMotion::usages`] a row is for; none where the recording says nothing.
    pub usage: Vec<Option<u16>>,
    /// s, ascending in a trajectory.
    pub time: Vec<f64>,
    /// rad or m.
    pub q: Vec<f64>,
    /// rad/s or m/s.
    pub velocity: Option<Vec<f64>>,
    /// A, of the motors.
    pub current: Option<Vec<f64>>,
    /// Nm, on the side of the joints.
    pub torque: Option<Vec<f64>>,
    /// Nm, on the side of the joints, by another simulation.
    pub simulated: Option<Vec<f64>>,
    /// C; NaN where a row has none.
    pub temperature: Option<Vec<f64>>,
}

impl ArmMotion {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.sequence.len()
    }
}

impl Table for ArmMotion {
    const KIND: &'static str = "motion";

    fn to_frame(&self) -> Result<Frame> {
        let mut frame = FrameBuilder::new(Self::KIND);
        frame.push("sequence", Cell::to_array(self.sequence.clone()));
        frame.push("trajectory", Cell::to_array(self.trajectory.clone()));
        let name = |usage: &Option<u16>| {
            usage.and_then(|usage| self.usages.get(usize::from(usage)).cloned())
        };
        frame.push(
            "usage",
            Cell::to_array(self.usage.iter().map(name).collect::<Vec<Option<String>>>()),
        );
        for (setting, values) in [
            ("time", Some(&self.time)),
            ("q", Some(&self.q)),
            ("velocity", self.velocity.as_ref()),
            ("current", self.current.as_ref()),
            ("torque", self.torque.as_ref()),
            ("simulated", self.simulated.as_ref()),
            ("temperature", self.temperature.as_ref()),
        ] {
            if let Some(values) = values {
                push_numbers(&mut frame, declared(setting), &self.prismatic, values);
            }
        }
        frame.finish()
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let prismatic = prismatic(frame);
        let numbers_of = |setting| numbers(frame, declared(setting), &prismatic);
        let (mut usages, mut places) = (Vec::new(), BTreeMap::new());
        let mut number = |name: Option<String>| {
            let name = name?;
            Some(*places.entry(name).or_insert_with_key(|name| {
                usages.push(name.clone());
                (usages.len() - 1) as u16
            }))
        };
        let usage = frame
            .read::<Option<String>>("usage")?
            .into_iter()
            .map(&mut number)
            .collect();
        Ok(Self {
            joints: prismatic.len(),
            sequence: frame.read("sequence")?,
            trajectory: frame.read("trajectory")?,
            usage,
            usages,
            time: numbers_of("time")?.unwrap_or_default(),
            q: numbers_of("q")?.unwrap_or_default(),
            velocity: numbers_of("velocity")?,
            current: numbers_of("current")?,
            torque: numbers_of("torque")?,
            simulated: numbers_of("simulated")?,
            temperature: numbers_of("temperature")?,
            prismatic,
        })
    }
}

/// Columns of a joint's course and their units, where it turns and where it slides: velocity, measured, simulated, corrected.
const COURSES: [[(&str, Unit); 2]; 4] = [
    [
        ("dq{j}_rad_s", Unit::RadianPerSecond),
        ("dq{j}_mm_s", Unit::MillimetrePerSecond),
    ],
    [
        ("measured{j}_nm", Unit::NewtonMetre),
        ("measured{j}_n", Unit::Newton),
    ],
    [
        ("simulated{j}_nm", Unit::NewtonMetre),
        ("simulated{j}_n", Unit::Newton),
    ],
    [
        ("corrected{j}_nm", Unit::NewtonMetre),
        ("corrected{j}_n", Unit::Newton),
    ],
];

/// A column of a joint, from 0.
fn at_joint(name: &str, joint: usize) -> String {
    name.replace("{j}", &(joint + 1).to_string())
}

/// The judged rows; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueCourse {
    /// Number of joints.
    pub joints: usize,
    /// Which joints slide: m and N in the place of rad and Nm.
    pub prismatic: Vec<bool>,
    /// Number of the row, from 1.
    pub sequence: Vec<i64>,
    /// s.
    pub time: Vec<f64>,
    /// Whether no step was fitted to the row.
    pub held_out: Vec<bool>,
    /// Whether something pushed on the arm.
    pub in_event: Vec<bool>,
    /// Whether the arm rests.
    pub rest: Vec<bool>,
    /// rad/s.
    pub velocity: Vec<f64>,
    /// Nm.
    pub measured: Vec<f64>,
    /// Nm: of the rigid arm alone.
    pub simulated: Vec<f64>,
    /// Nm: with the findings.
    pub corrected: Vec<f64>,
}

impl TorqueCourse {
    /// The courses of a diagnosis; `sequence` numbers its rows, `prismatic` says which joints slide. Of rows of one number the first stands: the
    /// others were made up where rows of the recording are missing.
    pub fn of(diagnosis: &TorqueDiagnosis, prismatic: &[bool], sequence: &[i64]) -> Self {
        let (courses, joints) = (&diagnosis.courses, prismatic.len());
        let rows: Vec<usize> = (0..sequence.len())
            .filter(|row| *row == 0 || sequence[row - 1] != sequence[*row])
            .collect();
        Self {
            joints,
            prismatic: prismatic.to_vec(),
            sequence: kept(sequence, 1, &rows),
            time: kept(&courses.time, 1, &rows),
            held_out: kept(&courses.held_out, 1, &rows),
            in_event: kept(&courses.in_event, 1, &rows),
            rest: kept(&courses.at_rest, joints, &rows),
            velocity: kept(&courses.velocity, joints, &rows),
            measured: kept(&courses.measured, joints, &rows),
            simulated: kept(&courses.simulated, joints, &rows),
            corrected: kept(&courses.corrected, joints, &rows),
        }
    }

    /// A joint's part of a row-major list, by row.
    pub fn of_joint<'a, T: Copy>(
        &self,
        all: &'a [T],
        joint: usize,
    ) -> impl Iterator<Item = T> + use<'a, T> {
        all.iter().skip(joint).step_by(self.joints.max(1)).copied()
    }
}

impl Table for TorqueCourse {
    const KIND: &'static str = "torque_course";

    fn to_frame(&self) -> Result<Frame> {
        let mut frame = FrameBuilder::new(Self::KIND);
        frame.push("sequence", Cell::to_array(self.sequence.clone()));
        frame.push("time_s", Cell::to_array(self.time.clone()));
        frame.push("held_out", Cell::to_array(self.held_out.clone()));
        frame.push("in_event", Cell::to_array(self.in_event.clone()));
        for joint in 0..self.joints {
            frame.push(
                format!("rest{}", joint + 1),
                Cell::to_array(self.of_joint(&self.rest, joint).collect()),
            );
        }
        let all = [
            &self.velocity,
            &self.measured,
            &self.simulated,
            &self.corrected,
        ];
        for (names, all) in COURSES.iter().zip(all) {
            for joint in 0..self.joints {
                let (name, unit) = names[usize::from(self.prismatic[joint])];
                let values = self.of_joint(all, joint).map(|value| unit.from_si(value));
                frame.push(at_joint(name, joint), Cell::to_array(values.collect()));
            }
        }
        frame.finish()
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let joints = (1..)
            .take_while(|joint| frame.column(&format!("rest{joint}")).is_some())
            .count();
        let slides = |joint: usize| frame.column(&at_joint(COURSES[0][1].0, joint)).is_some();
        let prismatic: Vec<bool> = (0..joints).map(slides).collect();
        let all = |course: usize| -> Result<Vec<f64>> {
            let read = |joint: usize| -> Result<Vec<f64>> {
                let (name, unit) = COURSES[course][usize::from(prismatic[joint])];
                let values = frame.read::<f64>(&at_joint(name, joint))?.into_iter();
                Ok(values.map(|value| unit.to_si(value)).collect())
            };
            Ok(interleaved(
                &(0..joints).map(read).collect::<Result<Vec<_>>>()?,
            ))
        };
        Ok(Self {
            joints,
            sequence: frame.read("sequence")?,
            time: frame.read("time_s")?,
            held_out: frame.read("held_out")?,
            in_event: frame.read("in_event")?,
            rest: of_joints(frame, "rest{j}", joints)?,
            velocity: all(0)?,
            measured: all(1)?,
            simulated: all(2)?,
            corrected: all(3)?,
            prismatic,
        })
    }
}

/// Some rows of row-major values.
fn kept<T: Copy>(values: &[T], width: usize, rows: &[usize]) -> Vec<T> {
    rows.iter()
        .flat_map(|row| &values[row * width..(row + 1) * width])
        .copied()
        .collect()
}

/// The columns of all joints, row-major.
pub(super) fn of_joints<C: Cell + Copy>(
    frame: &Frame,
    name: &str,
    joints: usize,
) -> Result<Vec<C>> {
    let read = |joint: usize| frame.read::<C>(&at_joint(name, joint));
    Ok(interleaved(
        &(0..joints).map(read).collect::<Result<Vec<_>>>()?,
    ))
}
