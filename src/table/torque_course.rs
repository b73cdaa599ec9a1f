//! Measured and predicted torques over time.

use crate::dynamics::TorqueDiagnosis;
use crate::error::Result;
use crate::store::frame::{Cell, Frame, FrameBuilder};
use crate::table::Table;

/// The judged rows; key `sequence`. Per-joint quantities are row-major (`row * joints + joint`).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TorqueCourse {
    /// Joints of the arm.
    pub joints: usize,
    /// Row of the recording.
    pub sequence: Vec<i64>,
    /// s.
    pub time: Vec<f64>,
    /// Whether no step was fitted to the row.
    pub held_out: Vec<bool>,
    /// Whether something pushed on the arm.
    pub in_event: Vec<bool>,
    /// Whether the joint rests.
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
