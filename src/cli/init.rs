//! `calib init`: a commented robot file and pipeline to start from, made for the columns of one's own files.

mod columns;
mod names;
mod robots;

use super::emit;
use crate::error::{Error, Fault, Result, counted};
use clap::Args;
use columns::Found;
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
    let found = arguments.data.iter().map(|path| Found::read(path)).collect::<Result<Vec<Found>>>()?;
    let joints = found.iter().map(|file| file.joints.len()).max().filter(|n| *n > 0);
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
    let text = pipeline_text(arguments, &found);
    for (path, text) in [(&robot, &robot_text), (&pipeline, &text)] {
        std::fs::write(path, text).map_err(refused(path))?;
    }
    emit(&closing(arguments, &found, &robot, &pipeline))
}

/// Whether no file has columns of joints, or of the measured point.
fn missing(found: &[Found]) -> [bool; 2] {
    [found.iter().all(|file| file.joints.is_empty()), found.iter().all(|file| file.point.len() < 3)]
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

/// How the pipeline's folder names a file.
fn from_folder(folder: &Path, file: &Path) -> String {
    let whole = |path: &Path| path.canonicalize().ok();
    let inside = whole(folder).zip(whole(file)).and_then(|(folder, file)| Some(file.strip_prefix(folder).ok()?.to_path_buf()));
    let path = inside.or_else(|| whole(file)).unwrap_or_else(|| file.to_path_buf());
    quoted(&path.display().to_string())
}

/// A YAML text in double quotes; JSON's escapes are YAML's.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn pipeline_text(arguments: &InitArguments, found: &[Found]) -> String {
    let name = arguments.folder.canonicalize().ok().and_then(|path| Some(path.file_name()?.to_string_lossy().into_owned()));
    let name: String = name.unwrap_or_default().chars().filter(|c| c.is_ascii_alphanumeric() || "_-".contains(*c)).collect();
    let name = if name.is_empty() { "cell".into() } else { name };
    let mut out = format!(
        "# A calibration, step by step. `calib check` tells every fault with its line, `calib run` does what is not already done.\ncalib: 1\nname: {name}\nseed: 1                 # everything random derives from it\n\nstages:\n"
    );
    let urdf = arguments.urdf.as_ref().map(|path| format!(", urdf: {}", from_folder(&arguments.folder, path)));
    out.push_str(&format!("  - uses: robot\n    with: {{file: robot.yaml{}}}\n\n", urdf.unwrap_or_default()));
    out.push_str("  # Which column holds what, in which unit. Nothing is guessed when this runs: what stands here counts.\n");
    out.push_str("  - uses: ingest\n    with:\n      files:\n");
    if found.is_empty() {
        out.push_str(EMPTY);
    }
    let missing = missing(found);
    for (k, (path, file)) in arguments.data.iter().zip(found).enumerate() {
        out.push_str(&format!("        - file: {}\n", from_folder(&arguments.folder, path)));
        // Joints come first, in the controller's file; the tracker's is the last.
        out.push_str(&file.yaml([missing[0] && k == 0, missing[1] && k + 1 == found.len()]));
    }
    if found.len() == 2 {
        let by_id = found.iter().all(|file| file.id.is_some());
        let join = if by_id {
            "by: id}          # by the point's name"
        } else {
            "by: order}       # CHECK: row by row, since no column of names was found in both"
        };
        out.push_str(&format!("      join: {{{join}\n"));
    }
    let by_usage = found.iter().any(|file| file.usage.is_some());
    out.push_str(if by_usage { BY_USAGE } else { EVERY });
    out.push_str(STAGES);
    out
}

const EMPTY: &str = "        - file: measurements.csv        # REPLACE
          columns:
            point_id: {column: name}      # REPLACE each column by yours
            q: {column: \"q{j}\", unit: deg}
            x: {column: x, unit: mm}
            y: {column: y, unit: mm}
            z: {column: z, unit: mm}
";

const EVERY: &str = "
  # A quarter of the points is never fitted to: they say how accurate the robot is at new poses.
  - uses: split
    with: {by: every, n: 4}
";

const BY_USAGE: &str = "
  # The recording says itself what each row is for; rows of the set `fit` are fitted to, all others judge.
  - uses: split
    with: {by: usage, blank: fit}
";

const STAGES: &str = "
  # Where the robot stands in the tracker's frame: the error before calibration.
  - id: nominal
    uses: identify
    with: {effects: [base_frame]}

  # Lengths, twists, zeros and reduction ratios.
  - id: geometry
    uses: identify
    with: {effects: [base_frame, tool_offset, joint_offset, link_geometry, reduction_ratio, coupling_ratio]}

  # What else is wrong with the robot, and the model with it.
  - uses: diagnose

  - uses: validate

  - uses: report
    with:
      # limits: {mean_mm: 0.3, max_mm: 0.8}      # what you accept; the report says whether it is kept
      # identity: {operator: A. Meier, robot serial: 4711, tracker: AT960 no. 123, date: 2026-11-21}     # stands on the report as given
      title: null                              # the heading; null: the robot's name
";
