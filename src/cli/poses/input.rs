//! Ranges on the command line, the robot file, and recordings to compare with.

use crate::error::{Error, Result};
use crate::raw;
use crate::robot::description::{JointKind, RobotDescription};
use crate::robot::import::{Text, read_calib, read_case};
use crate::robot::{Instrument, Measurements};
use crate::store::frame::FrameBuilder;
use crate::table::{Recording, Table};
use nalgebra::Vector3;
use std::path::Path;

/// Rows read at a time.
const BATCH: usize = 1 << 16;

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
    let table = read(path).map_err(|message| {
        Error::data(&label, format!("is not a `recording` table of calib ({message}); `ingest` makes one of any recording"))
    })?;
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

fn read(path: &Path) -> Result<Recording, String> {
    let file = raw::open(path).map_err(|error| error.to_string())?;
    let batch = raw::parquet(file, BATCH)?.whole()?;
    let mut frame = FrameBuilder::new(Recording::KIND);
    for (field, column) in batch.schema().fields().iter().zip(batch.columns()) {
        frame.push(field.name(), column.clone());
    }
    let named = |error: Error| match error {
        Error::Bug(message) => message,
        other => other.to_string(),
    };
    Recording::from_frame(&frame.finish().map_err(named)?).map_err(named)
}
