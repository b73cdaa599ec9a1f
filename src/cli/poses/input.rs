//! Ranges on the command line, the robot file, and recordings to compare with.

use crate::error::{Error, Fault, Result};
use crate::raw;
use crate::robot::description::{JointKind, RobotDescription};
use crate::robot::import::{Text, read_calib, read_case};
use crate::robot::{Instrument, Measurements};
use crate::table::{Loose, Recording, from_file};
use nalgebra::Vector3;
use std::io::Write;
use std::path::Path;

/// Lower and upper ends; infinite where left empty.
#[derive(Debug, Clone)]
pub(super) struct Ranges(pub Vec<[f64; 2]>);

/// `-10:10,:5,3:` -> ranges.
pub(super) fn ranges(text: &str) -> Result<Ranges, String> {
    let end = |text: &str, free: f64| match text.trim() {
        "" => Ok(free),
        number => number.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| format!("`{number}` is no number")),
    };
    let one = |part: &str| {
        let (lower, upper) = part.split_once(':').ok_or_else(|| format!("`{part}` is no range; expected MIN:MAX"))?;
        let range = [end(lower, f64::NEG_INFINITY)?, end(upper, f64::INFINITY)?];
        if range[0] < range[1] { Ok(range) } else { Err(format!("`{part}` is empty; expected MIN:MAX with MIN below MAX")) }
    };
    text.split(',').map(one).collect::<Result<_, _>>().map(Ranges)
}

/// Reads a robot file by its ending: `.json` is the practice layout, all else calib's YAML.
pub(super) fn robot(path: &Path, urdf: Option<&Path>) -> Result<RobotDescription> {
    let read = |path: &Path| {
        let label = path.display().to_string();
        let text = raw::text(path).map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
        Ok((label, text))
    };
    let (label, text) = read(path)?;
    let file = Text { label: &label, text: &text };
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json")) {
        return Ok(read_case(file)?.robot);
    }
    let urdf = urdf.map(read).transpose()?;
    Ok(read_calib(file, urdf.as_ref().map(|(label, text)| Text { label, text }))?.robot)
}

/// Joints and payloads of a recording, as if measured with `sigma` (m) per axis.
pub(super) fn recording(path: &Path, robot: &RobotDescription, sigma: f64) -> Result<Measurements> {
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
    if !vouched {
        let _ = writeln!(std::io::stderr(), "warning: {label} carries no content hash: whether it was changed cannot be told");
    }
    let prismatic: Vec<bool> = robot.joints.iter().map(|joint| joint.kind == JointKind::Prismatic).collect();
    if table.prismatic != prismatic {
        let message = format!("has {} joints of other number or kind than the robot file's {}", table.joints, prismatic.len());
        return Err(Error::data(label, message));
    }
    if table.rows() == 0 {
        return Err(Error::data(label, "has no rows"));
    }
    let mut data = table.measurements(&Instrument::default());
    data.sigma = vec![Vector3::repeat(sigma); data.rows()];
    Ok(data)
}
