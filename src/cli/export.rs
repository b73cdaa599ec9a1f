//! `calib export`: the identified model for other programs, and what they cannot carry.
//!
//! `calib check-export`: whether a file in the field belongs to this robot and this model.

use super::pipeline_arguments::ModelArguments;
use super::{emit, note, put};
use crate::error::{Error, Result};
use crate::export::{
    Belonging, CarriedTorques, DRIVE_FORMATS, DriveExport, DriveFormat, Export, FORMATS, Format,
};
use crate::identified::IdentifiedDrives;
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
///
/// Of a diagnosis of drives MJCF and `isaac` carry gains, damping, armature, friction, limits and delay, JSON all of it; `mjcf_control` is Python
/// next to the MJCF for what MuJoCo's model cannot hold.
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

/// A format of a model of positions or torques, of drives, or of both.
#[derive(Clone, Copy)]
struct Chosen {
    name: &'static str,
    format: Option<&'static Format>,
    of_drives: Option<&'static DriveFormat>,
}

/// The formats as values of an option, each with its line of help.
fn formats() -> impl TypedValueParser<Value = Chosen> {
    let values = all_formats().map(|(chosen, help)| PossibleValue::new(chosen.name).help(help));
    PossibleValuesParser::new(values).try_map(|name| {
        let mut all = all_formats();
        let chosen = all.find(|(chosen, _)| chosen.name == name);
        chosen.map(|(chosen, _)| chosen).ok_or("no format")
    })
}

fn all_formats() -> impl Iterator<Item = (Chosen, &'static str)> {
    let of_drives = |name: &str| DRIVE_FORMATS.iter().find(|format| format.name == name);
    let of_both = FORMATS.iter().map(move |format| {
        let chosen = Chosen {
            name: format.name,
            format: Some(format),
            of_drives: of_drives(format.name),
        };
        (chosen, format.help)
    });
    let is_alone = |one: &&DriveFormat| FORMATS.iter().all(|format| format.name != one.name);
    let alone = DRIVE_FORMATS.iter().filter(is_alone).map(|one| {
        let chosen = Chosen {
            name: one.name,
            format: None,
            of_drives: Some(one),
        };
        (chosen, one.help)
    });
    of_both.chain(alone)
}

const EXAMPLES: &str = "Examples:
  calib export pipeline.yaml --format urdf --out corrected.urdf
  calib export latest --format mdh --step geometry
  calib export pipelines/dynamics/pipeline.yaml --format mjcf --out arm.xml
  calib export pipelines/drives/pipeline.yaml --format isaac
  calib export parameters.parquet --robot robot.yaml --format controller";

impl ExportArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        if let Some(drives) = self.model.drives(Purpose::Export, command_line)? {
            return self.drives(drives);
        }
        let Some(format) = self.format.format else {
            let message = "holds drives alone, which `diagnose_drives` diagnoses; allowed here: ";
            let names: Vec<&str> = FORMATS.iter().map(|format| format.name).collect();
            return Err(Error::spec(
                "--format",
                message.to_string() + &names.join(", "),
            ));
        };
        let identified = self.model.load(Purpose::Export, command_line)?;
        identified.spare(self.out.as_deref())?;
        if identified.is_of_torques_alone() && format.carries == CarriedTorques::Nothing {
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
        let text = (format.text)(&export)?;
        self.written(text, &export.remarks_in(format))
    }

    fn written(&self, text: String, remarks: &[String]) -> Result<()> {
        put(self.out.as_deref(), text)?;
        if !self.model.quiet {
            let lines = remarks.iter().map(|line| format!("{line}\n"));
            note(lines.collect::<String>());
        }
        Ok(())
    }

    /// Of a diagnosis of drives.
    fn drives(&self, drives: IdentifiedDrives) -> Result<()> {
        let Some(format) = self.format.of_drives else {
            let names: Vec<&str> = DRIVE_FORMATS.iter().map(|format| format.name).collect();
            let message = format!(
                "drives were diagnosed, no geometry and no torques, and it holds none; allowed: {}",
                names.join(", ")
            );
            return Err(Error::spec("--format", message));
        };
        let export = DriveExport::of(drives, format);
        self.written(export.text()?, &export.remarks()?)
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
