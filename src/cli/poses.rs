//! `calib poses`: which poses to measure, before anything is measured.

use crate::cli::surroundings::open_store;
use crate::cli::{emit, emit_json, warn};
use crate::error::{Error, Fault, Result};
use crate::identified::robot_file;
use crate::poses::{
    PoseAnswer, PoseRequest, RunStage, apart, fault, places, proposal, sockets, write,
};
use clap::Args;
use std::path::PathBuf;

/// Propose poses to measure: the best for all parameters together, or for separating two effects.
///
/// Random poses inside the limits, the box and above the floor are improved by exchange until no exchange adds information; parameters
/// that position data cannot tell do not count. Beside the result stand 200 random sets of as many poses, and a recorded one.
///
/// SELF-COLLISION IS NOT CHECKED, nor collision with the cell: drive the poses slowly first. The way between them is short but
/// not planned. A direction +1 means: the joint's last move goes upwards. Poses of a run (--run) are in the controller's counting of the
/// joints, those of a robot file in the file's.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct PosesArguments {
    /// The robot file: calib's YAML, or a practice robot.json
    #[arg(
        value_name = "ROBOT",
        required_unless_present = "run",
        conflicts_with = "run"
    )]
    robot: Option<PathBuf>,
    /// The URDF that the robot file refers to
    #[arg(long, value_name = "FILE", requires = "robot")]
    urdf: Option<PathBuf>,
    /// Takes robot, model, sizes, noise and places from this run's diagnosis: to separate a finding from its rival
    #[arg(long, value_name = "RUN", requires = "separate", conflicts_with_all = ["effects", "against"])]
    run: Option<String>,
    /// The stage of the run, where there are several `diagnose`
    #[arg(long, value_name = "STAGE", requires = "run")]
    step: Option<String>,
    /// Where the run is [default: .calib in the working directory]
    #[arg(long, value_name = "DIR", requires = "run")]
    store: Option<PathBuf>,
    /// Poses to propose
    #[arg(long, short = 'n', value_name = "N", default_value_t = 50, value_parser = clap::value_parser!(u32).range(1..=2000))]
    count: u32,
    /// Effects to determine, by canonical name [default: all that `identify` estimates]
    #[arg(long, value_name = "EFFECT,..", value_delimiter = ',')]
    effects: Vec<String>,
    /// Chooses poses that separate these two effects instead. Of a run: a finding by its number or as `joint_compliance@joint 2` [default:
    /// the first with a rival], and the rival, as `link_compliance@link 2` [default: its closest rival]
    #[arg(long, num_args = 0..=2, value_names = ["EFFECT", "RIVAL"])]
    separate: Option<Vec<String>>,
    /// Joint ranges instead of the robot file's, in its counting, deg (mm for a prismatic joint)
    #[arg(long, value_name = "MIN:MAX,..", allow_hyphen_values = true, value_parser = ranges)]
    limits: Option<Ranges>,
    /// Part of each joint's travel left free at either end for the move of approach, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 2.0)]
    margin: f64,
    /// Where the measured point may be in the base frame, mm; a side left empty is free, e.g. 500:2500,-1000:1000,300:
    #[arg(long = "box", value_name = "XMIN:XMAX,YMIN:YMAX,ZMIN:ZMAX", allow_hyphen_values = true, value_parser = ranges)]
    bounds: Option<Ranges>,
    /// Height in the base frame below which neither the measured point nor a link's centre of mass may be, mm
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    floor: Option<f64>,
    /// Payloads at hand, kg; poses are grouped by them [default: 0, or those of the run]
    #[arg(long, value_name = "KG,..", value_delimiter = ',')]
    payload: Vec<f64>,
    /// Standard deviation per axis of a measured point, instrument and repeatability, mm [default: that of the recording `--against` or of the run, else 0.02]
    #[arg(long, value_name = "MM")]
    sigma: Option<f64>,
    /// Postures that bring a ball on the tool to sockets instead, by joints alone: where these are in the base frame, m
    #[arg(long, value_name = "[[X,Y,Z],..]", requires = "robot", value_parser = sockets_of, allow_hyphen_values = true,
          conflicts_with_all = ["separate", "against", "effects", "bounds"])]
    sockets: Option<SocketPlaces>,
    /// Random poses to choose from
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    candidates: u32,
    /// The same seed gives the same poses
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Compares with a recording: a `recording` table of calib (Parquet)
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// Writes the poses to this file, .csv or .parquet
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Prints one JSON document on stdout, with the poses
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "Examples:
  calib poses robot.yaml --count 50 --payload 0,210 --floor 200 --out poses.csv
  calib poses robot.yaml --box 500:2500,-1200:1200,300:2400 --against .calib/tables/cell7/ingest.recording.parquet
  calib poses robot.yaml --separate reduction_ratio joint_compliance --payload 0,105,210 --count 30 --out more.csv
  calib poses robot.yaml --sockets '[[0.4,0.1,0.0],[0.4,0.15,0.0]]' --count 60 --out sockets.csv
  calib poses --run HEAD --separate --count 30 --out more.csv
  calib poses --run HEAD --separate 1 'link_compliance@link 2' --payload 0,10
  calib poses robot.json --limits -170:170,-60:75,-80:75,-180:180,-120:120,-180:180 --json";

impl PosesArguments {
    pub(crate) fn run(&self) -> Result<()> {
        let request = request(self);
        let pair = self.separate.as_deref().unwrap_or_default();
        check(self, &request, pair)?;
        match (&self.run, &self.robot) {
            (Some(run), _) => {
                let store = open_store(self.store.as_deref())?;
                let step = self.step.as_deref();
                show(
                    self,
                    &apart(&request, &store, &RunStage { run, step }, pair)?,
                )
            }
            (None, Some(file)) => {
                let robot = robot_file(file, self.urdf.as_deref())?;
                let place = file.display().to_string();
                if let Some(places) = &self.sockets {
                    return show(self, &sockets(&request, robot, &place, &places.0)?);
                }
                let against = self.against.as_deref();
                show(self, &proposal(&request, robot, &place, pair, against)?)
            }
            (None, None) => Err(Error::spec("ROBOT", "expected a robot file, or --run")),
        }
    }
}

fn request(arguments: &PosesArguments) -> PoseRequest {
    PoseRequest {
        count: arguments.count as usize,
        candidates: arguments.candidates as usize,
        seed: arguments.seed,
        effects: arguments.effects.clone(),
        limits: arguments.limits.as_ref().map(|limits| limits.0.clone()),
        margin: arguments.margin,
        bounds: arguments.bounds.as_ref().map(|bounds| bounds.0.clone()),
        floor: arguments.floor,
        payloads: arguments.payload.clone(),
        sigma: arguments.sigma,
        out: arguments.out.clone(),
    }
}

fn show(arguments: &PosesArguments, answer: &PoseAnswer) -> Result<()> {
    warn(&answer.warnings);
    if let (Some(path), Some(poses)) = (&arguments.out, &answer.drive) {
        write(path, poses)?;
    }
    if arguments.json {
        emit_json(&answer.document)
    } else {
        emit(&answer.text)
    }
}

/// m, base frame.
#[derive(Debug, Clone)]
struct SocketPlaces(Vec<[f64; 3]>);

fn sockets_of(text: &str) -> Result<SocketPlaces, String> {
    places(text).map(SocketPlaces)
}

/// Lower and upper ends; infinite where left empty.
#[derive(Debug, Clone)]
pub(super) struct Ranges(pub Vec<[f64; 2]>);

/// `-10:10,:5,3:` -> ranges.
pub(super) fn ranges(text: &str) -> Result<Ranges, String> {
    let end = |text: &str, free: f64| match text.trim() {
        "" => Ok(free),
        number => number
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite())
            .ok_or_else(|| format!("`{number}` is no number")),
    };
    let one = |part: &str| {
        let (lower, upper) = part
            .split_once(':')
            .ok_or_else(|| format!("`{part}` is no range; expected MIN:MAX"))?;
        let range = [end(lower, f64::NEG_INFINITY)?, end(upper, f64::INFINITY)?];
        if range[0] < range[1] {
            Ok(range)
        } else {
            Err(format!(
                "`{part}` is empty; expected MIN:MAX with MIN below MAX"
            ))
        }
    };
    text.split(',')
        .map(one)
        .collect::<Result<_, _>>()
        .map(Ranges)
}

/// Everything that can be said without a file, all at once.
fn check(arguments: &PosesArguments, request: &PoseRequest, pair: &[String]) -> Result<()> {
    let of_robot = arguments.run.is_none();
    let mut faults = request.faults(if of_robot { pair } else { &[] });
    if of_robot && arguments.separate.is_some() && pair.is_empty() {
        faults.push(Fault::new(
            "--separate",
            "expected two effects, or a run whose findings have rivals (--run)",
        ));
    }
    if let Some(path) = &arguments.out {
        faults.extend(fault(path).map(|fault| Fault::new("--out", fault)));
    }
    Error::if_spec(faults)
}
