//! Recordings that proposed poses are compared with.

use crate::description::{JointKind, RobotDescription};
use crate::error::{Error, Fault, Result};
use crate::estimate::choose::median;
use crate::robot::{Measurements, NoiseBasis};
use crate::table::{Loose, Recording, from_file};
use std::path::Path;

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
