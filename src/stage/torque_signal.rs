//! A recorded motion with its torques at the joints, from sensors or motor currents.

use crate::description::RobotDescription;
use crate::dynamics::{TorqueRecording, TorqueSource};
use crate::error::{Error, Result};
use crate::stage::Chunks;
use crate::stage::dynamic_arm::torque_per_ampere;
use crate::table::ArmMotion;

/// Which rows judge and choose nothing; a row is told by its number in the recording, from 0.
pub(super) type HeldOut<'a> = dyn Fn(&ArmMotion, usize, usize) -> bool + 'a;

/// Torques of a motion that is read chunk by chunk.
pub(super) struct RecordedTorques<'a> {
    motion: &'a Chunks<ArmMotion>,
    joints: usize,
    /// Nm per A of each joint, where motor currents were recorded.
    factor: Option<Vec<f64>>,
    /// Whether a row of a chunk is held out, by the number of the chunk's first row and its own in the chunk; without it none is.
    held_out: Option<Box<HeldOut<'a>>>,
}

impl<'a> RecordedTorques<'a> {
    /// The torques of a motion. Fails where it has neither torques nor currents, or the robot file does not say what an ampere is.
    pub fn of(motion: &'a Chunks<ArmMotion>, robot: &RobotDescription) -> Result<Self> {
        let mut seen = None;
        motion.each(|chunk| {
            seen.get_or_insert((
                chunk.joints,
                chunk.torque.is_some(),
                chunk.current.is_some(),
            ));
            Ok(())
        })?;
        let (joints, torque, current) = seen.unwrap_or_default();
        let factor = match (torque, current) {
            (true, _) => None,
            (false, true) => Some(torque_per_ampere(robot)?),
            (false, false) => {
                return Err(Error::data(
                    "table motion",
                    "has neither torques nor currents",
                ));
            }
        };
        Ok(Self {
            motion,
            joints,
            factor,
            held_out: None,
        })
    }

    /// The same with rows that judge in the end.
    pub fn holding_out(self, held_out: Box<HeldOut<'a>>) -> Self {
        Self {
            held_out: Some(held_out),
            ..self
        }
    }

    /// Whether torques are motor currents times a constant.
    pub fn is_current(&self) -> bool {
        self.factor.is_some()
    }

    fn block(&self, mut motion: ArmMotion, first: usize) -> TorqueRecording {
        let rows = motion.rows();
        let held_out = match &self.held_out {
            Some(held_out) => (0..rows).map(|row| held_out(&motion, first, row)).collect(),
            None => vec![false; rows],
        };
        let torque = match (&self.factor, motion.current.take()) {
            (Some(factor), Some(mut current)) => {
                current
                    .chunks_exact_mut(factor.len())
                    .for_each(|row| row.iter_mut().zip(factor).for_each(|(i, k)| *i *= k));
                current
            }
            _ => motion.torque.take().unwrap_or_default(),
        };
        TorqueRecording {
            joints: motion.joints,
            time: motion.time,
            position: motion.q,
            velocity: motion.velocity,
            torque,
            temperature: motion.temperature,
            trajectory: motion
                .trajectory
                .iter()
                .map(|number| u32::try_from(*number).unwrap_or(u32::MAX))
                .collect(),
            held_out,
            from_current: self.is_current(),
        }
    }
}

impl TorqueSource for RecordedTorques<'_> {
    fn joints(&self) -> usize {
        self.joints
    }

    fn rows(&self) -> usize {
        self.motion.rows()
    }

    fn blocks(&self, take: &mut dyn FnMut(&TorqueRecording) -> Result<()>) -> Result<()> {
        let mut first = 0;
        self.motion.each(|chunk| {
            let rows = chunk.rows();
            take(&self.block(chunk, first))?;
            first += rows;
            Ok(())
        })
    }
}
