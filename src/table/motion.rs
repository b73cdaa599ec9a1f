//! An arm that moves: joints and their torques or motor currents, in the order of time. SI in Rust, mm and rad in the table.
//!
//! Measured and predicted torques over time.

use crate::dynamics::TorqueDiagnosis;
use crate::error::Result;
use crate::store::frame::{Cell, Frame, FrameBuilder};
use crate::table::Table;
use crate::units::Unit;
use std::collections::BTreeMap;

/// Rows in the order of time; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ArmMotion {
    /// Joints of the arm.
    pub(crate) joints: usize,
    /// Which joints are prismatic.
    pub(crate) prismatic: Vec<bool>,
    /// From 1.
    pub(crate) sequence: Vec<i64>,
    /// Stretch of the recording, from 1.
    pub(crate) trajectory: Vec<i64>,
    /// What rows may be for.
    pub(crate) usages: Vec<String>,
    /// Which of [`ArmMotion::usages`] a row is for; none where the recording says nothing.
    pub(crate) usage: Vec<Option<u16>>,
    /// s, ascending in a trajectory.
    pub(crate) time: Vec<f64>,
    /// rad or m.
    pub(crate) q: Vec<f64>,
    /// rad/s or m/s.
    pub(crate) velocity: Option<Vec<f64>>,
    /// A, of the motors.
    pub(crate) current: Option<Vec<f64>>,
    /// Nm, on the side of the joints.
    pub(crate) torque: Option<Vec<f64>>,
    /// C; NaN where a row has none.
    pub(crate) temperature: Option<Vec<f64>>,
}

/// Stored names of a per-joint quantity and their units; `sliding` is that of prismatic joints.
#[derive(Clone, Copy)]
struct PerJoint {
    turning: (&'static str, Unit),
    sliding: (&'static str, Unit),
}

const Q: PerJoint = PerJoint {
    turning: ("q{j}_rad", Unit::Radian),
    sliding: ("q{j}_mm", Unit::Millimetre),
};
const VELOCITY: PerJoint = PerJoint {
    turning: ("dq{j}_rad_s", Unit::RadianPerSecond),
    sliding: ("dq{j}_mm_s", Unit::MillimetrePerSecond),
};
const CURRENT: PerJoint = PerJoint {
    turning: ("i{j}_a", Unit::Ampere),
    sliding: ("i{j}_a", Unit::Ampere),
};
const TORQUE: PerJoint = PerJoint {
    turning: ("tau{j}_nm", Unit::NewtonMetre),
    sliding: ("tau{j}_nm", Unit::NewtonMetre),
};

impl PerJoint {
    fn column(self, joint: usize, prismatic: bool) -> (String, Unit) {
        let (name, unit) = if prismatic {
            self.sliding
        } else {
            self.turning
        };
        (name.replace("{j}", &(joint + 1).to_string()), unit)
    }

    fn push(self, frame: &mut FrameBuilder, prismatic: &[bool], all: &[f64]) {
        for (joint, slides) in prismatic.iter().enumerate() {
            let (name, unit) = self.column(joint, *slides);
            let values = all.iter().skip(joint).step_by(prismatic.len());
            frame.push(
                name,
                Cell::to_array(
                    values
                        .map(|value| unit.from_si(*value))
                        .collect::<Vec<f64>>(),
                ),
            );
        }
    }

    /// Row-major, SI; none where the table has no such columns.
    fn read(self, frame: &Frame, prismatic: &[bool]) -> Result<Option<Vec<f64>>> {
        let named: Vec<(String, Unit)> = prismatic
            .iter()
            .enumerate()
            .map(|(joint, slides)| self.column(joint, *slides))
            .collect();
        if named
            .first()
            .is_none_or(|(name, _)| frame.column(name).is_none())
        {
            return Ok(None);
        }
        let mut columns = Vec::with_capacity(named.len());
        for (name, unit) in &named {
            let mut values = frame.read::<f64>(name)?;
            values
                .iter_mut()
                .for_each(|value| *value = unit.to_si(*value));
            columns.push(values);
        }
        Ok(Some(interleaved(&columns)))
    }
}

impl ArmMotion {
    /// How many rows.
    pub(crate) fn rows(&self) -> usize {
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
        frame.push("time_s", Cell::to_array(self.time.clone()));
        Q.push(&mut frame, &self.prismatic, &self.q);
        for (quantity, all) in [
            (VELOCITY, &self.velocity),
            (CURRENT, &self.current),
            (TORQUE, &self.torque),
        ] {
            all.iter()
                .for_each(|all| quantity.push(&mut frame, &self.prismatic, all));
        }
        if let Some(all) = &self.temperature {
            let stored = all.iter().map(|value| (!value.is_nan()).then_some(*value));
            frame.push(
                "temp_c",
                Cell::to_array(stored.collect::<Vec<Option<f64>>>()),
            );
        }
        frame.finish()
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let has = |name: String| frame.column(&name).is_some();
        let prismatic: Vec<bool> = (1..)
            .map(|joint| (has(format!("q{joint}_rad")), has(format!("q{joint}_mm"))))
            .take_while(|(turns, slides)| *turns || *slides)
            .map(|(_, slides)| slides)
            .collect();
        let (mut usages, mut numbers) = (Vec::new(), BTreeMap::new());
        let mut number = |name: Option<String>| {
            let name = name?;
            Some(*numbers.entry(name).or_insert_with_key(|name| {
                usages.push(name.clone());
                (usages.len() - 1) as u16
            }))
        };
        let usage = frame
            .read::<Option<String>>("usage")?
            .into_iter()
            .map(&mut number)
            .collect();
        let temperature = match frame.column("temp_c") {
            Some(_) => {
                let all = frame.read::<Option<f64>>("temp_c")?;
                Some(
                    all.into_iter()
                        .map(|value| value.unwrap_or(f64::NAN))
                        .collect(),
                )
            }
            None => None,
        };
        Ok(Self {
            joints: prismatic.len(),
            sequence: frame.read("sequence")?,
            trajectory: frame.read("trajectory")?,
            usage,
            usages,
            time: frame.read("time_s")?,
            q: Q.read(frame, &prismatic)?.unwrap_or_default(),
            velocity: VELOCITY.read(frame, &prismatic)?,
            current: CURRENT.read(frame, &prismatic)?,
            torque: TORQUE.read(frame, &prismatic)?,
            temperature,
            prismatic,
        })
    }
}

/// The judged rows; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueCourse {
    /// Joints of the arm.
    pub(crate) joints: usize,
    /// Row of the recording.
    pub(crate) sequence: Vec<i64>,
    /// s.
    pub(crate) time: Vec<f64>,
    /// Whether no step was fitted to the row.
    pub(crate) held_out: Vec<bool>,
    /// Whether something pushed on the arm.
    pub(crate) in_event: Vec<bool>,
    /// Whether the joint rests.
    pub(crate) rest: Vec<bool>,
    /// rad/s.
    pub(crate) velocity: Vec<f64>,
    /// Nm.
    pub(crate) measured: Vec<f64>,
    /// Nm: of the rigid arm alone.
    pub(crate) simulated: Vec<f64>,
    /// Nm: with the findings.
    pub(crate) corrected: Vec<f64>,
}

impl TorqueCourse {
    /// The courses of a diagnosis; `sequence` numbers its rows. Of rows of one number the first stands: the others were made up where rows of
    /// the recording are missing.
    pub fn of(diagnosis: &TorqueDiagnosis, joints: usize, sequence: &[i64]) -> Self {
        let courses = &diagnosis.courses;
        let rows: Vec<usize> = (0..sequence.len())
            .filter(|row| *row == 0 || sequence[row - 1] != sequence[*row])
            .collect();
        Self {
            joints,
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
    pub(crate) fn of_joint<'a, T: Copy>(
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
        for (name, all) in [
            ("dq{j}_rad_s", &self.velocity),
            ("measured{j}_nm", &self.measured),
            ("simulated{j}_nm", &self.simulated),
            ("corrected{j}_nm", &self.corrected),
        ] {
            for joint in 0..self.joints {
                let name = name.replace("{j}", &(joint + 1).to_string());
                frame.push(name, Cell::to_array(self.of_joint(all, joint).collect()));
            }
        }
        frame.finish()
    }

    fn from_frame(frame: &Frame) -> Result<Self> {
        let joints = (1..)
            .take_while(|joint| frame.column(&format!("rest{joint}")).is_some())
            .count();
        let all = |name: &str| -> Result<Vec<f64>> {
            let read = |joint: usize| frame.read::<f64>(&name.replace("{j}", &joint.to_string()));
            Ok(interleaved(
                &(1..=joints).map(read).collect::<Result<Vec<_>>>()?,
            ))
        };
        let rest = (1..=joints)
            .map(|joint| frame.read::<bool>(&format!("rest{joint}")))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            joints,
            sequence: frame.read("sequence")?,
            time: frame.read("time_s")?,
            held_out: frame.read("held_out")?,
            in_event: frame.read("in_event")?,
            rest: interleaved(&rest),
            velocity: all("dq{j}_rad_s")?,
            measured: all("measured{j}_nm")?,
            simulated: all("simulated{j}_nm")?,
            corrected: all("corrected{j}_nm")?,
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

/// Columns of equal length -> row-major.
pub(super) fn interleaved<T: Copy>(columns: &[Vec<T>]) -> Vec<T> {
    let rows = columns.first().map_or(0, Vec::len);
    (0..rows)
        .flat_map(|row| columns.iter().map(move |column| column[row]))
        .collect()
}
