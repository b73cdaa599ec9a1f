//! Where the arm may go, by what was asked and what the robot file says.

use super::PoseRequest;
use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Fault, Result, counted};
use crate::estimate::choose::Site;
use crate::units::Unit;

/// Where the arm may go; a joint without limits keeps to its range in `recorded`, where there is one.
pub(super) fn site(
    request: &PoseRequest,
    robot: &RobotDescription,
    place: &str,
    recorded: Option<&[[f64; 2]]>,
) -> Result<Site> {
    let unit = |kind| {
        if kind == JointKind::Revolute {
            Unit::Degree
        } else {
            Unit::Millimetre
        }
    };
    let mut ranges = Vec::new();
    let mut faults = Vec::new();
    let given = request.limits.as_ref();
    if let Some(given) = given.filter(|given| given.len() != robot.joints.len()) {
        return Err(Error::spec(
            "--limits",
            format!(
                "has {}, the robot {}",
                counted(given.len(), "range"),
                counted(robot.joints.len(), "joint")
            ),
        ));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let limits = match given.and_then(|given| given.get(index)) {
            Some(range) => Some(range.map(|value| unit(joint.kind).to_si(value))),
            None => joint.limits,
        };
        match limits {
            Some([lower, upper]) if lower.is_finite() && upper.is_finite() => {
                let free = 1e-2 * request.margin * (upper - lower);
                ranges.push([lower + free, upper - free]);
            }
            _ if recorded.is_some() => ranges.extend(recorded.and_then(|all| all.get(index))),
            _ => faults.push(Fault::new(
                place,
                format!(
                    "joint {} has no limits; put them into the robot file, or give --limits with a range for every joint",
                    index + 1
                ),
            )),
        }
    }
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    let mut bounds = [[f64::NEG_INFINITY, f64::INFINITY]; 3];
    if let Some(given) = &request.bounds {
        for (bound, range) in bounds.iter_mut().zip(given) {
            *bound = range.map(|value| Unit::Millimetre.to_si(value));
        }
    }
    let mut payloads = if request.payloads.is_empty() {
        vec![0.0]
    } else {
        request.payloads.clone()
    };
    payloads.sort_by(f64::total_cmp);
    payloads.dedup();
    let floor = request
        .floor
        .map_or(f64::NEG_INFINITY, |height| Unit::Millimetre.to_si(height));
    Ok(Site {
        ranges,
        bounds,
        floor,
        payloads,
    })
}
