//! Recordings that proposed poses are compared with.

use crate::error::{Error, Fault, Result};
use crate::robot::Measurements;
use crate::robot::description::{JointKind, RobotDescription};
use crate::table::{Loose, Recording, from_file};
use nalgebra::Vector3;
use std::path::Path;

/// Joints and payloads of a recording, as if measured with `sigma` (m) per axis, and a warning where nothing vouches for them.
pub(super) fn recording(path: &Path, robot: &RobotDescription, sigma: f64) -> Result<(Measurements, Option<String>)> {
    let label = path.display().to_string();
    let Loose { table, vouched } = from_file::<Recording>(path).map_err(|error| match error {
        Error::Data(faults) => Error::Data(
            faults
                .into_iter()
                .map(|fault| Fault {
                    message: format!("{}; `ingest` makes a `recording` table of any recording", fault.message),
                    ..fault
                })
                .collect(),
        ),
        other => other,
    })?;
    let warning = (!vouched).then(|| format!("{label} carries no content hash: whether it was changed cannot be told"));
    let prismatic: Vec<bool> = robot.joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect();
    if table.prismatic != prismatic {
        let message = format!("has {} joints of other number or kind than the robot file's {}", table.joints, prismatic.len());
        return Err(Error::data(label, message));
    }
    if table.rows() == 0 {
        return Err(Error::data(label, "has no rows"));
    }
    let mut data = table.measurements();
    data.sigma = vec![Vector3::repeat(sigma); data.rows()];
    Ok((data, warning))
}
