//! `calib check-export`: whether a file in the field belongs to this robot and this model.

use super::model_arguments::ModelArguments;
use super::{complain, emit};
use crate::error::{Error, Result};
use crate::export::{Belonging, Export};
use crate::pipeline::Purpose;
use crate::raw;
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

/// Check whether an exported file belongs to a robot and its model, unchanged.
///
/// Every export carries its format, the hash of the model and the robot's serial number (`identity: {robot serial: ...}` of the stage
/// `report`). The file is compared with these, then written anew and compared line by line; comments do not count.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct CheckExportArguments {
    /// The exported file
    file: PathBuf,
    #[command(flatten)]
    model: ModelArguments,
}

const EXAMPLES: &str = "Examples:
  calib check-export corrected.urdf --against latest
  calib check-export ur10e_calibration.yaml --against pipeline.yaml

Exit codes: 0 it is; 1 it is that of another robot or model, or was edited; 10 it is no export.";

pub(super) fn main(arguments: &CheckExportArguments, command_line: &[OsString]) -> u8 {
    execute(arguments, command_line).unwrap_or_else(|error| complain(&error))
}

fn execute(arguments: &CheckExportArguments, command_line: &[OsString]) -> Result<u8> {
    let label = arguments.file.display().to_string();
    let text = raw::text(&arguments.file).map_err(|error| Error::unreadable(&label, &error))?;
    let identified = arguments.model.load(Purpose::Export, command_line)?;
    let origin = identified.origin.clone();
    // Nothing is written here: a format that holds the arm badly may have been insisted on.
    let export = Export::of(identified, true);
    let serial = |serial: &Option<String>| serial.clone().unwrap_or_else(|| "not stated".into());
    let (statement, code) = match export.check(&label, &text)? {
        Belonging::Same(mark) => (
            format!(
                "is the export of {origin}: {}, model {}, robot serial {}",
                mark.format,
                mark.model,
                serial(&mark.serial)
            ),
            0,
        ),
        Belonging::Edited(mark, line) => (
            format!(
                "line {line} is not as {origin} (model {}) exports it: the file was edited, or another version wrote it",
                mark.model
            ),
            1,
        ),
        Belonging::Other(file, own) if file.serial != own.serial => (
            format!(
                "is of the robot with serial {}; that of {origin} is {}",
                serial(&file.serial),
                serial(&own.serial)
            ),
            1,
        ),
        Belonging::Other(file, own) => (
            format!(
                "is of the model {}; that of {origin} is {}",
                file.model, own.model
            ),
            1,
        ),
    };
    emit(&format!("{label}: {statement}\n"))?;
    Ok(code)
}
