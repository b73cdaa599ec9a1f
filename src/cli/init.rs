//! `calib init`: a commented robot file and pipeline to start from, made for the columns of one's own files.

mod columns;
mod names;
mod pipeline;
mod points;
mod robots;
mod sheet;
mod together;
mod words;

use super::emit;
use crate::error::{Error, Fault, Result, counted};
use clap::Args;
use columns::Found;
use pipeline::missing;
use robots::Kind;
use std::path::{Path, PathBuf};

/// Write a robot file and a pipeline to start from, with comments, for the columns found in your recordings.
///
/// Nothing is asked and nothing is overwritten. What was read from the files' columns is a proposal: lines to look at are marked CHECK, numbers
/// to fill in REPLACE. Then: `calib check pipeline.yaml`, `calib run pipeline.yaml`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct InitArguments {
    /// The folder for robot.yaml and pipeline.yaml
    #[arg(value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Recordings, delimited text: one file, or the controller's and the tracker's
    #[arg(long, short, value_name = "FILE", num_args = 1..=2)]
    data: Vec<PathBuf>,
    /// The robot to start from
    #[arg(long, value_enum, default_value_t = Kind::Spherical6)]
    robot: Kind,
    /// Takes the robot from this URDF instead
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
    /// Its last link
    #[arg(long, value_name = "LINK", requires = "urdf", default_value = "tool0")]
    tip: String,
}

const EXAMPLES: &str = "Examples:
  calib init cell7 --data cell7/controller.csv cell7/tracker.csv --robot spherical6
  calib init cell7 --data measurements.csv --urdf arm.urdf --tip flange
  calib init --robot seven";

pub(super) fn main(arguments: &InitArguments) -> Result<()> {
    let [robot, pipeline] = ["robot.yaml", "pipeline.yaml"].map(|name| arguments.folder.join(name));
    let there = [&robot, &pipeline].into_iter().filter(|path| path.exists());
    let faults: Vec<Fault> =
        there.map(|path| Fault::new(path.display().to_string(), "is already there; nothing was written")).collect();
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    let mut found = arguments.data.iter().map(|path| Found::read(path)).collect::<Result<Vec<Found>>>()?;
    let joints = found.iter().filter_map(|file| file.get("q")).map(|joints| joints.choices[0].columns.len()).max();
    let robot_text = match &arguments.urdf {
        Some(_) => robots::of_urdf(&arguments.tip),
        None => {
            if let Some(n) = joints.filter(|n| *n != arguments.robot.joints()) {
                return Err(Error::spec(
                    "--robot",
                    format!(
                        "{} has {}, the recording {n}; choose another kind",
                        arguments.robot.name(),
                        counted(arguments.robot.joints(), "joint")
                    ),
                ));
            }
            arguments.robot.text()
        }
    };
    let refused = |path: &Path| {
        let place = path.display().to_string();
        move |error: std::io::Error| Error::store(place.clone(), format!("cannot be written: {error}"))
    };
    std::fs::create_dir_all(&arguments.folder).map_err(refused(&arguments.folder))?;
    let joined = together::join(&mut found);
    let text = pipeline::text(arguments, &found, &joined);
    for (path, text) in [(&robot, &robot_text), (&pipeline, &text)] {
        std::fs::write(path, text).map_err(refused(path))?;
    }
    emit(&closing(arguments, &found, &robot, &pipeline))
}

fn closing(arguments: &InitArguments, found: &[Found], robot: &Path, pipeline: &Path) -> String {
    let mut text = String::new();
    for (path, file) in arguments.data.iter().zip(found) {
        text.push_str(&format!("{}: {}\n", path.display(), file.account()));
    }
    let (robot, pipeline) = (robot.display(), pipeline.display());
    text.push_str(&format!("wrote {robot} and {pipeline}\n\nnext:\n"));
    if arguments.urdf.is_none() {
        text.push_str(&format!("  1. {robot}: put your robot's numbers where it says REPLACE\n"));
    } else {
        text.push_str(&format!("  1. {robot}: say where the measured point sits on the tool\n"));
    }
    let unknown = ["columns of joints", "the measured point"].into_iter().zip(missing(found)).filter(|(_, missing)| *missing);
    let unknown: Vec<&str> = unknown.map(|(what, _)| what).collect();
    let name = if found.is_empty() || unknown.is_empty() {
        String::new()
    } else {
        format!("; name {} where it says REPLACE: they were not recognised", unknown.join(" and "))
    };
    text.push_str(&format!("  2. {pipeline}: look at the lines marked CHECK{name}\n"));
    text.push_str(&format!("  3. calib check {pipeline}\n  4. calib run {pipeline}\n"));
    text
}

/// A YAML text in double quotes; JSON's escapes are YAML's.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
