//! `calib init`: a commented robot file and pipeline to start from, made for the columns of one's own files.

use super::emit;
use crate::error::{Error, Result};
use crate::init::{InitRequest, RobotFileKind, StarterFiles, TYPICAL, start};
use crate::robot::LIBRARY;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Write a robot file and a pipeline to start from: with comments, for the columns found in your recordings.
///
/// Nothing is asked and nothing is overwritten: a robot.yaml that is there is used as it is. What was read from the files' columns is a proposal: lines to look at are marked CHECK, numbers
/// to fill in REPLACE. Then: `calib check pipeline.yaml`, `calib run pipeline.yaml`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct InitArguments {
    /// The folder for robot.yaml and pipeline.yaml
    #[arg(value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Recordings, delimited text, workbooks (.xlsx), columns (Parquet, Feather) or bags of ROS 2 (.mcap, .db3): one file, the controller's and the tracker's, a tracker's for each of several reflectors, or torques of an arm that moves
    #[arg(long, short, value_name = "FILE", num_args = 1..)]
    data: Vec<PathBuf>,
    /// The robot to start from: an arm of the library (`calib robots` lists them), or a typical one whose numbers you replace
    ///
    /// Without it the robot.yaml of the folder; where there is none, the first typical one.
    #[arg(long, value_name = "ARM", value_parser = kinds())]
    robot: Option<RobotFileKind>,
    /// Takes the robot from this URDF instead, or says where the URDF lies that the folder's robot.yaml refers to
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// Its last link
    #[arg(long, value_name = "LINK", requires = "urdf", default_value = "tool0")]
    tip: String,
}

const EXAMPLES: &str = "Examples:
  calib init cell7 --data cell7/controller.csv cell7/tracker.csv --robot spherical6
  calib init cell7 --data measurements.csv --urdf arm.urdf --tip flange
  calib init cell7 --data measurements.csv --robot ur10e
  calib init --robot seven";

/// Typical robots as values of an option, each with its line of help; arms of the library are taken by name and listed by `calib robots`.
fn kinds() -> impl TypedValueParser<Value = RobotFileKind> {
    let typical = TYPICAL
        .iter()
        .map(|arm| PossibleValue::new(arm.name).help(arm.help));
    let arms = LIBRARY
        .iter()
        .map(|arm| PossibleValue::new(arm.name).hide(true));
    PossibleValuesParser::new(typical.chain(arms))
        .try_map(|name| RobotFileKind::find(&name).ok_or("no such arm"))
}

impl InitArguments {
    /// Gives the exit code: 1 where nothing was understood of the recordings.
    pub(crate) fn run(&self) -> Result<u8> {
        let start = execute(self)?;
        if !start.understood_nothing() {
            return Ok(0);
        }
        let files: Vec<String> = start
            .accounts
            .iter()
            .map(|(path, _)| path.display().to_string())
            .collect();
        let message = format!(
            "neither joints nor a measured point were recognised in {}: name the columns where it says REPLACE",
            files.join(" and ")
        );
        let _ = writeln!(std::io::stderr(), "error: {message}");
        Ok(1)
    }
}

fn execute(arguments: &InitArguments) -> Result<StarterFiles> {
    let InitArguments {
        folder,
        data,
        robot,
        urdf,
        tip,
    } = arguments;
    let files = ["robot.yaml", "pipeline.yaml"].map(|name| folder.join(name));
    if files[1].exists() {
        return Err(Error::spec(
            files[1].display().to_string(),
            "is already there; nothing was written",
        ));
    }
    let start = start(&InitRequest {
        folder,
        data,
        robot: *robot,
        urdf: urdf.as_deref(),
        tip,
    })?;
    let refused = |path: &Path| {
        let place = path.display().to_string();
        move |error: std::io::Error| {
            Error::store(place.clone(), format!("cannot be written: {error}"))
        }
    };
    std::fs::create_dir_all(folder).map_err(refused(folder))?;
    let texts = [start.robot.as_ref(), Some(&start.pipeline)];
    for (path, text) in files
        .iter()
        .zip(texts)
        .filter_map(|(path, text)| Some((path, text?)))
    {
        std::fs::write(path, text).map_err(refused(path))?;
    }
    for note in &start.notes {
        let _ = writeln!(std::io::stderr(), "warning: {note}");
    }
    emit(&closing(arguments, &start, &files))?;
    Ok(start)
}

fn closing(arguments: &InitArguments, start: &StarterFiles, files: &[PathBuf; 2]) -> String {
    let mut text = String::new();
    for (path, account) in &start.accounts {
        text.push_str(&format!("{}: {account}\n", path.display()));
    }
    let [robot, pipeline] = files.each_ref().map(|path| path.display());
    match &start.robot {
        Some(_) => text.push_str(&format!("wrote {robot} and {pipeline}\n\nnext:\n")),
        None => text.push_str(&format!(
            "wrote {pipeline} beside {robot}, which is used as it is\n\nnext:\n"
        )),
    }
    if start.robot.is_none() {
        text.push_str(&format!(
            "  1. {robot}: see that it is the robot of these recordings\n"
        ));
    } else if let Some(RobotFileKind::Arm(_)) = arguments.robot {
        text.push_str(&format!(
            "  1. {robot}: the arm's own numbers; put the measured point where it says REPLACE\n"
        ));
    } else if arguments.urdf.is_none() {
        text.push_str(&format!(
            "  1. {robot}: put your robot's numbers where it says REPLACE\n"
        ));
    } else {
        text.push_str(&format!(
            "  1. {robot}: say where the measured point sits on the tool\n"
        ));
    }
    let name = if start.missing.is_empty() {
        String::new()
    } else {
        format!(
            "; name {} where it says REPLACE: they were not recognised",
            start.missing.join(" and ")
        )
    };
    text.push_str(&format!(
        "  2. {pipeline}: look at the lines marked CHECK{name}\n"
    ));
    text.push_str(&format!(
        "  3. calib check {pipeline}\n  4. calib run {pipeline}\n"
    ));
    text
}
