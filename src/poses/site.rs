//! Where the arm may go, by what was asked and what the robot file says.

use super::PoseRequest;
use super::drive::joint_unit;
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
    let mut ranges = Vec::new();
    let mut faults = Vec::new();
    let given = request.limits.as_ref();
    if let Some(given) = given.filter(|given| given.len() != robot.joints.len()) {
        let [ranges, joints] = [(given.len(), "range"), (robot.joints.len(), "joint")]
            .map(|(count, what)| counted(count, what));
        let message = format!("has {ranges}, the robot {joints}");
        return Err(Error::spec("--limits", message));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let limits = match given.and_then(|given| given.get(index)) {
            Some(range) => Some(range.map(|value| joint_unit(joint.kind).to_si(value))),
            None => joint.limits,
        };
        match limits {
            Some([lower, upper]) if lower.is_finite() && upper.is_finite() => {
                let free = 1e-2 * request.margin * (upper - lower);
                ranges.push([lower + free, upper - free]);
            }
            _ if recorded.is_some() => ranges.extend(recorded.and_then(|all| all.get(index))),
            _ => {
                let number = index + 1;
                let message = format!(
                    "joint {number} has no limits; put them into the robot file, or give --limits with a range for every joint"
                );
                faults.push(Fault::new(place, message));
            }
        }
    }
    Error::if_spec(faults)?;
    let mut bounds = [[f64::NEG_INFINITY, f64::INFINITY]; 3];
    if let Some(given) = &request.bounds {
        for (bound, range) in bounds.iter_mut().zip(given) {
            *bound = range.map(|value| Unit::Millimetre.to_si(value));
        }
    }
    let mut payloads = request.payloads.clone();
    if payloads.is_empty() {
        payloads.push(0.0);
    }
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
    let all = data.points.sigma.iter().flatten().copied();
    let measured: Vec<f64> = all.filter(|sigma| sigma.is_finite()).collect();
    let stated = data.noise_basis != NoiseBasis::Inferred && !measured.is_empty();
    stated.then(|| median(measured))
}

/// A recording, and a warning where nothing vouches for it.
pub(super) fn recording(
    path: &Path,
    robot: &RobotDescription,
) -> Result<(Measurements, Option<String>)> {
    let label = path.display().to_string();
    let more = |fault: Fault| Fault {
        message: format!(
            "{}; `ingest` makes a `recording` table of any recording",
            fault.message
        ),
        ..fault
    };
    let Loose { table, vouched } = from_file::<Recording>(path).map_err(|error| match error {
        Error::Data(faults) => Error::Data(faults.into_iter().map(more).collect()),
        other => other,
    })?;
    let warning = (!vouched)
        .then(|| format!("{label} carries no content hash: its content cannot be verified"));
    let joints = robot.joints.iter();
    let prismatic: Vec<bool> = joints
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
