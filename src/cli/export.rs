//! `calib export`: the identified model for other programs, and what they cannot carry.

use super::emit;
use super::model_arguments::ModelArguments;
use crate::error::{Error, Result};
use crate::export::{CarriedTorques, Export, FORMATS, Format};
use crate::pipeline::Purpose;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::ffi::OsString;
use std::io::Write;
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

pub(super) fn main(arguments: &ExportArguments, command_line: &[OsString]) -> Result<()> {
    let identified = arguments.model.load(Purpose::Export, command_line)?;
    identified.spare(arguments.out.as_deref())?;
    if identified.is_of_torques_alone() && arguments.format.0.carries == CarriedTorques::Nothing {
        let allowed: Vec<&str> = FORMATS
            .iter()
            .filter(|format| format.carries != CarriedTorques::Nothing)
            .map(|format| format.name)
            .collect();
        let message = format!(
            "torques were identified, no geometry, and it holds none; allowed: {}",
            allowed.join(", ")
        );
        return Err(Error::spec("--format", message));
    }
    let export = Export::of(identified, arguments.model.force);
    let text = (arguments.format.0.text)(&export)?;
    match &arguments.out {
        Some(path) => std::fs::write(path, text).map_err(|error| {
            Error::store(
                path.display().to_string(),
                format!("cannot be written: {error}"),
            )
        })?,
        None => emit(&text)?,
    }
    if !arguments.model.quiet {
        let said: String = export
            .remarks_in(arguments.format.0)
            .iter()
            .map(|line| format!("{line}\n"))
            .collect();
        let _ = std::io::stderr().write_all(said.as_bytes());
    }
    Ok(())
}
