//! `calib export`: the identified model for other programs, and what they cannot carry.
//!
//! `calib check-export`: whether a file in the field belongs to this robot and this model.

use super::pipeline_arguments::ModelArguments;
use super::{emit, note, put};
use crate::error::{Error, Result};
use crate::export::{Belonging, CarriedTorques, Export, FORMATS, Format};
use crate::pipeline::Purpose;
use crate::raw;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::ffi::OsString;
use std::path::PathBuf;

/// Export the identified model: its corrected geometry for other programs, all of it as JSON, or numbers for the controller.
///
/// Formats carry rigid geometry; what they cannot carry (ratios, compliance, cyclic errors, a learned correction) is listed with what it does to
/// the point, in the file and on stderr. `calib compensate` uses all of it.
///
/// Of a diagnosis of torques URDF carries viscous and Coulomb friction and the identified inertials, MJCF rotor inertias and drives too; what
/// they cannot carry (Stribeck friction, friction of load, ripple) is listed with its size. All of it with sigma is in `dynamics`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct ExportArguments {
    #[command(flatten)]
    model: ModelArguments,
    /// What to write
    #[arg(long, short, value_parser = formats())]
    format: Chosen,
    /// Writes to this file [default: stdout]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Clone, Copy)]
struct Chosen(&'static Format);

/// The formats as values of an option, each with its line of help.
fn formats() -> impl TypedValueParser<Value = Chosen> {
    let values = FORMATS
        .iter()
        .map(|format| PossibleValue::new(format.name).help(format.help));
    PossibleValuesParser::new(values).try_map(|name| {
        FORMATS
            .iter()
            .find(|format| format.name == name)
            .map(Chosen)
            .ok_or("no format")
    })
}

const EXAMPLES: &str = "Examples:
  calib export pipeline.yaml --format urdf --out corrected.urdf
  calib export latest --format mdh --step geometry
  calib export pipelines/dynamics/pipeline.yaml --format mjcf --out arm.xml
  calib export parameters.parquet --robot robot.yaml --format controller";

impl ExportArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let identified = self.model.load(Purpose::Export, command_line)?;
        identified.spare(self.out.as_deref())?;
        if identified.is_of_torques_alone() && self.format.0.carries == CarriedTorques::Nothing {
            let carries = |format: &&Format| format.carries != CarriedTorques::Nothing;
            let allowed = FORMATS.iter().filter(carries).map(|format| format.name);
            let allowed: Vec<&str> = allowed.collect();
            let message = format!(
                "torques were identified, no geometry, and it holds none; allowed: {}",
                allowed.join(", ")
            );
            return Err(Error::spec("--format", message));
        }
        let export = Export::of(identified, self.model.force);
        let text = (self.format.0.text)(&export)?;
        put(self.out.as_deref(), text)?;
        if !self.model.quiet {
            let remarks = export.remarks_in(self.format.0);
            note(
                remarks
                    .iter()
                    .map(|line| format!("{line}\n"))
                    .collect::<String>(),
            );
        }
        Ok(())
    }
}

/// Check whether an exported file belongs to a robot and its model, unchanged.
///
/// Every export carries its format, the hash of the model and the robot's serial number (`identity: {robot serial: ...}` of the stage
/// `report`). The file is compared with these, then written anew and compared line by line; comments do not count.
#[derive(Args)]
#[command(after_help = CHECK_EXAMPLES)]
pub(super) struct CheckExportArguments {
    /// The exported file
    file: PathBuf,
    #[command(flatten)]
    model: ModelArguments,
}

const CHECK_EXAMPLES: &str = "Examples:
  calib check-export corrected.urdf --against latest
  calib check-export ur10e_calibration.yaml --against pipeline.yaml

Exit codes: 0 it is; 1 it is that of another robot or model, or was edited; 10 it is no export.";

impl CheckExportArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<u8> {
        let label = self.file.display().to_string();
        let text = raw::text(&self.file).map_err(|error| Error::unreadable(&label, &error))?;
        let identified = self.model.load(Purpose::Export, command_line)?;
        let origin = identified.origin.clone();
        // Nothing is written here: a format that holds the arm badly may have been insisted on.
        let export = Export::of(identified, true);
        let serial = |serial: &Option<String>| serial.clone().unwrap_or("not stated".into());
        let (statement, code) = match export.check(&label, &text)? {
            Belonging::Same(mark) => {
                let (format, model, serial) = (&mark.format, &mark.model, serial(&mark.serial));
                (
                    format!(
                        "is the export of {origin}: {format}, model {model}, robot serial {serial}"
                    ),
                    0,
                )
            }
            Belonging::Edited(mark, line) => {
                let model = &mark.model;
                (
                    format!(
                        "line {line} is not as {origin} (model {model}) exports it: the file was edited, or another version wrote it"
                    ),
                    1,
                )
            }
            Belonging::Other(file, here) if file.serial != here.serial => {
                let [file, here] = [&file, &here].map(|mark| serial(&mark.serial));
                (
                    format!("is of the robot with serial {file}; that of {origin} is {here}"),
                    1,
                )
            }
            Belonging::Other(file, here) => {
                let [file, here] = [file.model, here.model];
                (
                    format!("is of the model {file}; that of {origin} is {here}"),
                    1,
                )
            }
        };
        emit(&format!("{label}: {statement}\n"))?;
        Ok(code)
    }
}
