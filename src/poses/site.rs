//! Where the arm may go, by what was asked and what the robot file says.
//!
//! Recordings that proposed poses are compared with.

use super::PoseRequest;
use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Fault, Result, counted};
use crate::estimate::choose::{Site, median};
use crate::robot::{Measurements, NoiseBasis};
use crate::table::{Loose, Recording, from_file};
use crate::units::Unit;
use std::path::Path;

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

/// The usual standard deviation of an axis, m; none where no point was measured, or nobody stated it.
pub(super) fn usual_sigma(data: &Measurements) -> Option<f64> {
    let measured: Vec<f64> = data
        .points
        .sigma
        .iter()
        .flatten()
        .copied()
        .filter(|sigma| sigma.is_finite())
        .collect();
    let stated = data.noise_basis != NoiseBasis::Inferred && !measured.is_empty();
    stated.then(|| median(measured))
}

/// A recording, and a warning where nothing vouches for it.
pub(super) fn recording(
    path: &Path,
    robot: &RobotDescription,
) -> Result<(Measurements, Option<String>)> {
    let label = path.display().to_string();
    let Loose { table, vouched } = from_file::<Recording>(path).map_err(|error| match error {
        Error::Data(faults) => Error::Data(
            faults
                .into_iter()
                .map(|fault| Fault {
                    message: format!(
                        "{}; `ingest` makes a `recording` table of any recording",
                        fault.message
                    ),
                    ..fault
                })
                .collect(),
        ),
        other => other,
    })?;
    let warning = (!vouched)
        .then(|| format!("{label} carries no content hash: its content cannot be verified"));
    let prismatic: Vec<bool> = robot
        .joints
        .iter()
        .map(|joint| joint.kind == JointKind::Prismatic)
        .collect();
    if table.prismatic != prismatic {
        let message = format!(
            "has {} joints, not the number or kind of the robot file's {}",
            table.joints,
            prismatic.len()
        );
        return Err(Error::data(label, message));
    }
    if table.rows() == 0 {
        return Err(Error::data(label, "has no rows"));
    }
    Ok((table.measurements(), warning))
}
