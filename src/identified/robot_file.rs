//! A robot file by its path, as verbs take it beside a model.

use crate::description::RobotDescription;
use crate::error::{Error, Result};
use crate::raw;
use crate::robot::import::{RobotFileText, read_calib, read_case};
use std::path::Path;

/// Reads a robot file by its ending: `.json` is the practice layout, all else calib's YAML, beside which a URDF may stand.
pub fn robot_file(path: &Path, urdf: Option<&Path>) -> Result<RobotDescription> {
    let read = |path: &Path| {
        let label = path.display().to_string();
        let text = raw::text(path)
            .map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
        Ok((label, text))
    };
    let (label, text) = read(path)?;
    let file = RobotFileText {
        label: &label,
        text: &text,
    };
    if raw::ending(path) == "json" {
        return Ok(read_case(file)?.robot);
    }
    let urdf = urdf.map(read).transpose()?;
    Ok(read_calib(
        file,
        urdf.as_ref()
            .map(|(label, text)| RobotFileText { label, text }),
    )?
    .robot)
}
