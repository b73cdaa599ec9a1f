//! What a robot file without link masses costs: poses under load that no model can weigh.

use crate::error::counted;
use crate::robot::{Measurements, RobotModel};
use nalgebra::Vector3;

/// Cosine from which on gravity does not turn a joint.
const UPRIGHT: f64 = 0.99;

/// What is said where links without masses are under load.
pub(super) struct WeightlessLinks {
    /// What is missing, for a verdict.
    pub missing: String,
    /// The same with what it costs and what to do.
    pub warning: String,
}

/// What is said of links without masses at some rows; none where all masses are known, or weight turns no joint.
pub(super) fn weightless_links(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
) -> Option<WeightlessLinks> {
    let joints = &robot.description().joints;
    let bare = joints
        .iter()
        .filter(|joint| joint.mass.is_none() || joint.centre.is_none())
        .count();
    let gravity = Vector3::from(robot.description().gravity);
    let turned = |joint: usize| {
        let along = gravity.dot(robot.axis(joint)).abs() / gravity.norm().max(f64::MIN_POSITIVE);
        let mut angles = rows.iter().map(|row| data.q(*row)[joint]);
        let first = angles.next();
        robot.is_revolute(joint) && along < UPRIGHT && angles.any(|angle| Some(angle) != first)
    };
    if bare == 0 || gravity.norm() == 0.0 || !(0..robot.joints()).any(turned) {
        return None;
    }
    let (given, windup) = match joints.len() - bare {
        0 => (
            "no link masses".to_string(),
            "shows at best as an angle, without a stiffness",
        ),
        some => (
            format!("mass and centre of {some} of {} links alone", joints.len()),
            "cannot be computed",
        ),
    };
    let loaded = rows.iter().filter(|row| data.payload[**row] > 0.0).count();
    let load = match loaded {
        0 => String::new(),
        _ => format!(
            " ({} of {} carry a payload)",
            counted(loaded, "row"),
            rows.len()
        ),
    };
    let missing =
        format!("the robot file gives {given}, yet gravity loads joints in these poses{load}");
    let warning = format!(
        "{missing}: wind-up under the arm's own weight {windup}, bending and counterbalances cannot be computed, and what they do may be \
         attributed to another cause (gear, hose). Fill in `links` of the robot file"
    );
    Some(WeightlessLinks { missing, warning })
}
