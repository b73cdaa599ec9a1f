//! A recorded motion with its torques at the joints, from sensors or motor currents.

use crate::description::RobotDescription;
use crate::dynamics::TorqueRecording;
use crate::error::{Error, Result};
use crate::stage::dynamic_arm::torque_per_ampere;
use crate::table::ArmMotion;

/// Torques of a motion and its sequence numbers; `held_out` has a value a row, or none where nothing is held out. Fails where the motion has
/// neither torques nor currents, or the robot file does not say what an ampere is.
pub(super) fn torque_recording(
    mut motion: ArmMotion,
    robot: &RobotDescription,
    held_out: Vec<bool>,
) -> Result<(TorqueRecording, Vec<i64>)> {
    let (torque, from_current) = match (motion.torque.take(), motion.current.take()) {
        (Some(torque), _) => (torque, false),
        (None, Some(mut current)) => {
            let factor = torque_per_ampere(robot)?;
            current.chunks_exact_mut(factor.len()).for_each(|row| row.iter_mut().zip(&factor).for_each(|(i, k)| *i *= k));
            (current, true)
        }
        (None, None) => return Err(Error::data("table motion", "has neither torques nor currents")),
    };
    let rows = motion.rows();
    let recording = TorqueRecording {
        joints: motion.joints,
        time: motion.time,
        position: motion.q,
        velocity: motion.velocity,
        torque,
        temperature: motion.temperature,
        trajectory: motion.trajectory.iter().map(|number| u32::try_from(*number).unwrap_or(u32::MAX)).collect(),
        held_out: if held_out.is_empty() { vec![false; rows] } else { held_out },
        from_current,
    };
    Ok((recording, motion.sequence))
}
