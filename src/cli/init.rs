//! `calib init`: a commented robot file and pipeline to start from, made for the columns of one's own files.

use super::{emit, note, warn};
use crate::error::{Error, Result, did_you_mean, visible};
use crate::init::{InitRequest, StarterFiles, TYPICAL, start, start_drives, typical};
use crate::raw::ending;
use crate::robot::{LIBRARY, LibraryArm};
use crate::text::filled;
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command};
use minijinja::context;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Write a robot file and a pipeline to start from: with comments, for the columns found in your recordings.
///
/// Nothing is asked and nothing is overwritten: a robot.yaml (or the robot.json of a simulation) that is there is used as it is. What was read from the files' columns is a proposal: lines to look at are marked CHECK, numbers
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
    #[arg(long, value_name = "ARM", value_parser = Arms)]
    robot: Option<&'static LibraryArm>,
    /// Takes the robot from this URDF instead, or says where the URDF lies that the folder's robot.yaml refers to
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// Its last link
    #[arg(long, value_name = "LINK", requires = "urdf", default_value = "tool0")]
    tip: String,
    /// Of commands and measured angles: the MJCF that is simulated; the recording is one CSV or Parquet, two, their folder, or that of a LeRobot data set
    #[arg(long, value_name = "FILE", requires = "data", conflicts_with_all = ["robot", "urdf"])]
    mjcf: Option<PathBuf>,
}

/// Unread files that are named at most.
const NAMED: usize = 3;

const EXAMPLES: &str = "Examples:
  calib init cell7 --data cell7/controller.csv cell7/tracker.csv --robot spherical6
  calib init cell7 --data measurements.csv --urdf arm.urdf --tip flange
  calib init cell7 --data measurements.csv --robot ur10e
  calib init arm --data recording.csv --mjcf so101.xml
  calib init arm --data lerobot/so101_pick --mjcf so101.xml
  calib init --robot seven";

/// Typical robots as values of an option, each with its line of help; arms of the library are taken by name and listed by `calib robots`.
#[derive(Clone)]
struct Arms;

impl TypedValueParser for Arms {
    type Value = &'static LibraryArm;

    fn parse_ref(
        &self,
        command: &Command,
        _: Option<&Arg>,
        value: &OsStr,
    ) -> std::result::Result<Self::Value, clap::Error> {
        let name = value.to_string_lossy();
        let found = typical(&name).or_else(|| LibraryArm::find(&name));
        found.ok_or_else(|| {
            let typical: Vec<&str> = TYPICAL.iter().map(|(arm, _)| arm.name).collect();
            let arms = LIBRARY.iter().map(|arm| arm.name);
            let near = did_you_mean(&name, arms.chain(typical.iter().copied()));
            let message = format!(
                "--robot: no arm `{}`{near}{} allowed: {}, or one of the {} arms that `calib robots` lists\n",
                visible(&name),
                if near.is_empty() { ";" } else { "" },
                typical.join(", "),
                LIBRARY.len()
            );
            command.clone().error(ErrorKind::InvalidValue, message)
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let typical = TYPICAL.iter();
        Some(Box::new(
            typical.map(|(arm, help)| PossibleValue::new(arm.name).help(*help)),
        ))
    }
}

impl InitArguments {
    /// Gives the exit code: 1 where nothing was understood of the recordings.
    pub(crate) fn run(&self) -> Result<u8> {
        if let Some(mjcf) = &self.mjcf {
            return of_drives(self, mjcf);
        }
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
        note(format!("error: {message}\n"));
        Ok(1)
    }
}

/// The fault of a file that cannot be written.
fn refused(path: &Path) -> impl Fn(std::io::Error) -> Error {
    let place = path.display().to_string();
    move |error| Error::store(place.clone(), format!("cannot be written: {error}"))
}

/// For a recording of commands and angles.
fn of_drives(arguments: &InitArguments, mjcf: &Path) -> Result<u8> {
    let folder = &arguments.folder;
    let [pipeline, drives] = ["pipeline.yaml", "drives.json"].map(|name| folder.join(name));
    if pipeline.exists() {
        let place = pipeline.display().to_string();
        return Err(Error::spec(place, "is already there; nothing was written"));
    }
    let start = start_drives(folder, &arguments.data, mjcf)?;
    std::fs::create_dir_all(folder).map_err(refused(folder))?;
    let is_new = !drives.exists();
    if is_new {
        std::fs::write(&drives, &start.drives).map_err(refused(&drives))?;
    }
    std::fs::write(&pipeline, &start.pipeline).map_err(refused(&pipeline))?;
    warn(&start.notes);
    let (pipeline, drives) = (pipeline.display(), drives.display());
    let mut text: String = start
        .accounts
        .iter()
        .map(|line| format!("{line}\n"))
        .collect();
    text += &match is_new {
        true => format!("written: {pipeline}, {drives}; look at the lines marked CHECK\n"),
        false => format!("written: {pipeline}; {drives} was there and is used as it is\n"),
    };
    emit(&format!("{text}then: calib diagnose {pipeline}\n"))?;
    Ok(0)
}

fn execute(arguments: &InitArguments) -> Result<StarterFiles> {
    let InitArguments {
        folder,
        data,
        robot,
        urdf,
        tip,
        mjcf: _,
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
    std::fs::create_dir_all(folder).map_err(refused(folder))?;
    let texts = [start.robot.as_ref(), Some(&start.pipeline)];
    for (path, text) in files
        .iter()
        .zip(texts)
        .filter_map(|(path, text)| Some((path, text?)))
    {
        std::fs::write(path, text).map_err(refused(path))?;
    }
    let unread = match data.is_empty() {
        true => tables_in(folder),
        false => Vec::new(),
    };
    let unread = (!unread.is_empty()).then(|| {
        let written = files.iter().zip(texts).filter(|(_, text)| text.is_some());
        let written = written.map(|(path, _)| path.display().to_string());
        let written = written.collect::<Vec<_>>().join(" and ");
        let more = match unread.len().saturating_sub(NAMED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let named = unread[..unread.len().min(NAMED)].join(", ");
        format!(
            "not looked at in {}: {named}{more}; delete {written} and name the recording after --data",
            folder.display()
        )
    });
    warn(start.notes.iter().chain(&unread));
    emit(&closing(arguments, &start, &files))?;
    Ok(start)
}

/// Names of files that look like recordings, in their order.
fn tables_in(folder: &Path) -> Vec<String> {
    const ENDINGS: [&str; 8] = [
        "csv", "tsv", "txt", "xlsx", "parquet", "feather", "mcap", "db3",
    ];
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter(|entry| ENDINGS.contains(&&*ending(&entry.path())))
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn closing(arguments: &InitArguments, start: &StarterFiles, files: &[PathBuf; 2]) -> String {
    let robot = files[0]
        .with_file_name(start.robot_file)
        .display()
        .to_string();
    let pipeline = files[1].display().to_string();
    let account =
        |(path, account): &(PathBuf, String)| (path.display().to_string(), account.clone());
    let first = match (&start.robot, arguments.robot, &arguments.urdf) {
        (None, ..) => "see that it is the robot of these recordings",
        (Some(text), ..) if !text.contains("REPLACE") => "see that it is your robot",
        (_, Some(arm), _) if typical(arm.name).is_none() => {
            "the arm's own numbers; put the measured point where it says REPLACE"
        }
        (.., None) => "put your robot's numbers where it says REPLACE",
        (.., Some(_)) => "say where the measured point sits on the tool",
    };
    let about = context! {
        robot, pipeline, first, is_new => start.robot.is_some(), missing => &start.missing,
        accounts => start.accounts.iter().map(account).collect::<Vec<_>>(),
    };
    filled(include_str!("init.txt"), about)
}
