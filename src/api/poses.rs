//! Which poses to measure, as `calib poses` proposes them.

use super::{Poses, Robot};
use crate::error::{Error, Fault, Result};
use crate::poses::{PoseAnswer, PoseRequest, proposal};
use serde_json::Value;

/// Poses to measure, and what they promise.
#[derive(Debug, Clone, PartialEq)]
pub struct ProposedPoses {
    /// In the order of driving; columns are `payload_kg` and, of each joint, `dir`: whether its last move goes upwards.
    pub poses: Poses,
    /// As `calib poses` prints it.
    pub text: String,
    /// As `calib poses --json` prints it.
    pub document: Value,
}

/// Poses for all parameters together, or to separate two effects. Fails with what is wrong with the request, and where the arm cannot go
/// where it may.
pub fn propose_poses(
    robot: &Robot,
    request: &PoseRequest,
    pair: &[String],
) -> Result<ProposedPoses> {
    let faults = request.faults(pair);
    if !faults.is_empty() {
        // Settings have the names of the options.
        let named = faults.into_iter().map(|fault| Fault {
            place: fault.place.trim_start_matches('-').into(),
            ..fault
        });
        return Err(Error::Spec(named.collect()));
    }
    let description = robot.description.clone();
    let answer = proposal(request, description, &robot.description.name, pair, None)?;
    let drive = answer.drive();
    let poses = drive.map(|drive| Poses {
        joints_rad: robot.from_si(&drive.poses.q),
        columns: [
            ("payload_kg".to_string(), drive.poses.payload.clone()),
            ("dir".to_string(), drive.direction.to_vec()),
        ]
        .into(),
    });
    Ok(ProposedPoses {
        poses: poses.unwrap_or_default(),
        text: answer.text(),
        document: answer.document(),
    })
}
