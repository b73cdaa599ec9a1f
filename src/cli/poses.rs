//! `calib poses`: which poses to measure, before anything is measured.

mod apart;
mod input;
mod output;
mod show;

use super::{emit, emit_json};
use crate::effect::{EffectStack, Load, Setting, identified, whole};
use crate::error::{Error, Fault, Result, nearest};
use crate::estimate::Model;
use crate::estimate::choose::{Aim, Proposal, Score, Site, Wish, propose};
use crate::robot::description::{JointKind, RobotDescription};
use crate::robot::{Measurements, RobotModel};
use crate::spatial::Pose;
use crate::units::Unit;
use clap::Args;
use input::Ranges;
use nalgebra::Vector3;
use output::Drive;
use std::path::PathBuf;

/// Propose poses to measure: the best for all parameters together, or for telling two effects apart.
///
/// Random poses inside the limits, the box and above the floor are improved by exchange until no other tells more; parameters
/// that position data cannot tell do not count. Beside the result stand 200 random sets of as many poses, and a recorded one.
///
/// SELF-COLLISION IS NOT CHECKED, nor collision with the cell: drive the poses slowly first. The way between them is short but
/// not planned. A direction +1 means: the joint's last move goes upwards.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct PosesArguments {
    /// The robot file: calib's YAML, or a practice robot.json
    #[arg(value_name = "ROBOT", required_unless_present = "run", conflicts_with = "run")]
    robot: Option<PathBuf>,
    /// The URDF that the robot file refers to
    #[arg(long, value_name = "FILE", requires = "robot")]
    urdf: Option<PathBuf>,
    /// Takes robot, model, sizes, noise and places from this run's diagnosis: tells a finding from its rival
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
    /// Effects to tell, by canonical name [default: all that `identify` estimates]
    #[arg(long, value_name = "EFFECT,..", value_delimiter = ',')]
    effects: Vec<String>,
    /// Chooses for telling these two effects apart instead. Of a run: a finding by its number or as `joint_compliance@joint 2` [default:
    /// the first with a rival], and what it is to be told from, as `link_compliance@link 2` [default: its closest rival]
    #[arg(long, num_args = 0..=2, value_names = ["EFFECT", "RIVAL"])]
    separate: Option<Vec<String>>,
    /// Joint ranges instead of the robot file's, deg (mm for a prismatic joint)
    #[arg(long, value_name = "MIN:MAX,..", allow_hyphen_values = true, value_parser = input::ranges)]
    limits: Option<Ranges>,
    /// Part of each joint's travel left free at either end for the move of approach, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 2.0)]
    margin: f64,
    /// Where the measured point may be in the base frame, mm; a side left empty is free, e.g. 500:2500,-1000:1000,300:
    #[arg(long = "box", value_name = "XMIN:XMAX,YMIN:YMAX,ZMIN:ZMAX", allow_hyphen_values = true, value_parser = input::ranges)]
    bounds: Option<Ranges>,
    /// Height in the base frame below which neither the measured point nor a link's centre of mass may be, mm
    #[arg(long, value_name = "MM", allow_hyphen_values = true)]
    floor: Option<f64>,
    /// Payloads at hand, kg; poses are grouped by them [default: 0, or those of the run]
    #[arg(long, value_name = "KG,..", value_delimiter = ',')]
    payload: Vec<f64>,
    /// Standard deviation per axis of a measured point, instrument and repeatability, mm [default: 0.02, or the run's]
    #[arg(long, value_name = "MM")]
    sigma: Option<f64>,
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
  calib poses --run HEAD --separate --count 30 --out more.csv
  calib poses --run HEAD --separate 1 'link_compliance@link 2' --payload 0,10
  calib poses robot.json --limits -170:170,-60:75,-80:75,-180:180,-120:120,-180:180 --json";

/// What was proposed and what for; made once, shown as text, JSON or file.
struct Work<'a> {
    arguments: &'a PosesArguments,
    robot: RobotDescription,
    ranges: Vec<[f64; 2]>,
    effects: Vec<&'static str>,
    /// Effects left out, with the reason.
    left_out: Vec<(&'static str, String)>,
    /// Names and units of the stack's parameters.
    parameters: Vec<(String, Unit)>,
    /// mm.
    sigma: f64,
    proposal: Proposal,
    recorded: Option<Score>,
}

impl Work<'_> {
    fn drive(&self) -> Drive<'_> {
        let Proposal { poses, direction, .. } = &self.proposal;
        Drive { robot: &self.robot, ranges: &self.ranges, poses, direction }
    }
}

/// mm.
const SIGMA: f64 = 0.02;

pub(super) fn main(arguments: &PosesArguments) -> Result<()> {
    check(arguments)?;
    let pair = arguments.separate.as_deref().unwrap_or_default();
    let file = match (&arguments.run, &arguments.robot) {
        (Some(run), _) => return apart::main(arguments, run, pair),
        (None, Some(file)) => file,
        (None, None) => return Err(Error::spec("ROBOT", "expected a robot file, or --run")),
    };
    let imported = input::robot(file, arguments.urdf.as_deref())?;
    let place = file.display().to_string();
    let site = site(arguments, &imported, &place, None)?;
    let robot = RobotModel::new(imported.clone());
    let (effects, left_out) = effects(arguments, &robot, &site);
    let model = || model(&robot, &effects);
    let aim = match pair {
        [a, b] => Aim::Separation([a.clone(), b.clone()]),
        _ => Aim::Information,
    };
    for name in pair {
        if let Some((_, reason)) = left_out.iter().find(|(left, _)| left == name) {
            return Err(Error::spec("--separate", format!("`{name}` cannot be told: {reason}")));
        }
    }
    let shown = arguments.sigma.unwrap_or(SIGMA);
    let sigma = shown * 1e-3;
    let wish = wish(arguments, aim, sigma);
    let recording = arguments.against.as_ref().map(|path| input::recording(path, &imported, sigma)).transpose()?;
    let proposal = propose(model(), &site, &wish).map_err(|fault| Error::spec(place, fault))?;
    let recorded = recording.map(|data| proposal.jacobian.score(&model(), &data, &proposal.workspace));
    let parameters = model().stack.specs().iter().map(|spec| (spec.name.clone(), spec.unit)).collect();
    let ranges = site.ranges;
    let result = Work { arguments, robot: imported, ranges, effects, left_out, parameters, sigma: shown, proposal, recorded };
    if let Some(path) = &arguments.out {
        output::write(path, &result.drive())?;
    }
    if arguments.json { emit_json(&show::document(&result)) } else { emit(&show::text(&result)) }
}

/// `sigma` in m.
fn wish(arguments: &PosesArguments, aim: Aim, sigma: f64) -> Wish {
    Wish { aim, count: arguments.count as usize, candidates: arguments.candidates as usize, sigma, seed: arguments.seed }
}

/// Everything that can be said without a file, all at once.
fn check(arguments: &PosesArguments) -> Result<()> {
    let mut faults = Vec::new();
    let none = Vec::new();
    let separate = arguments.separate.as_ref().filter(|_| arguments.run.is_none());
    for (option, names) in [("--effects", &arguments.effects), ("--separate", separate.unwrap_or(&none))] {
        for name in names.iter().filter(|name| whole(name, &setting()).is_none()) {
            let known: Vec<&str> = identified().map(|cause| cause.name()).collect();
            let hint = nearest(name, known.iter().copied()).map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
            faults.push(Fault::new(option, format!("unknown effect `{name}`; {hint}allowed: {}", known.join(", "))));
        }
    }
    if separate.is_some_and(|names| names.len() != 2) {
        faults.push(Fault::new("--separate", "expected two effects, or a run whose findings have rivals (--run)"));
    }
    if let Some([a, b]) = separate.map(Vec::as_slice) {
        if a == b {
            faults.push(Fault::new("--separate", format!("expected two different effects, found `{a}` twice")));
        }
        let chosen = |name: &String| arguments.effects.is_empty() || arguments.effects.contains(name);
        for name in [a, b].into_iter().filter(|name| !chosen(name)) {
            faults.push(Fault::new("--effects", format!("`{name}` is to be separated but is not among them")));
        }
    }
    for mass in arguments.payload.iter().filter(|mass| !(mass.is_finite() && **mass >= 0.0)) {
        faults.push(Fault::new("--payload", format!("expected masses of 0 or more, kg, found {mass}")));
    }
    if let Some(sigma) = arguments.sigma.filter(|sigma| !(sigma.is_finite() && *sigma > 0.0)) {
        faults.push(Fault::new("--sigma", format!("expected a length above 0, mm, found {sigma}")));
    }
    if !(0.0..=45.0).contains(&arguments.margin) {
        faults.push(Fault::new("--margin", format!("expected 0 to 45 percent, found {}", arguments.margin)));
    }
    if let Some(bounds) = arguments.bounds.as_ref().filter(|bounds| bounds.0.len() != 3) {
        faults.push(Fault::new("--box", format!("expected three ranges, x, y, z, found {}", bounds.0.len())));
    }
    if let Some(path) = &arguments.out {
        faults.extend(output::fault(path).map(|fault| Fault::new("--out", fault)));
    }
    if faults.is_empty() { Ok(()) } else { Err(Error::Spec(faults)) }
}

/// Where the arm may go; a joint without limits keeps to its range in `recorded`, where there is one.
fn site(arguments: &PosesArguments, robot: &RobotDescription, place: &str, recorded: Option<&[[f64; 2]]>) -> Result<Site> {
    let unit = |kind| if kind == JointKind::Revolute { Unit::Degree } else { Unit::Millimetre };
    let mut ranges = Vec::new();
    let mut faults = Vec::new();
    let given = arguments.limits.as_ref().map(|limits| &limits.0);
    if let Some(given) = given.filter(|given| given.len() != robot.joints.len()) {
        return Err(Error::spec("--limits", format!("has {} ranges, the robot {} joints", given.len(), robot.joints.len())));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let limits = match given.and_then(|given| given.get(index)) {
            Some(range) => Some(range.map(|value| unit(joint.kind).to_si(value))),
            None => joint.limits,
        };
        match limits {
            Some([lower, upper]) if lower.is_finite() && upper.is_finite() => {
                let free = 1e-2 * arguments.margin * (upper - lower);
                ranges.push([lower + free, upper - free]);
            }
            _ if recorded.is_some() => ranges.extend(recorded.and_then(|all| all.get(index))),
            _ => faults.push(Fault::new(
                place,
                format!(
                    "joint {} has no limits; put them into the robot file, or give --limits with a range for every joint",
                    index + 1
                ),
            )),
        }
    }
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    let mut bounds = [[f64::NEG_INFINITY, f64::INFINITY]; 3];
    if let Some(given) = &arguments.bounds {
        for (bound, range) in bounds.iter_mut().zip(&given.0) {
            *bound = range.map(|value| Unit::Millimetre.to_si(value));
        }
    }
    let mut payloads = if arguments.payload.is_empty() { vec![0.0] } else { arguments.payload.clone() };
    payloads.sort_by(f64::total_cmp);
    payloads.dedup();
    let floor = arguments.floor.map_or(f64::NEG_INFINITY, |height| Unit::Millimetre.to_si(height));
    Ok(Site { ranges, bounds, floor, payloads })
}

type Named = (Vec<&'static str>, Vec<(&'static str, String)>);

/// The chosen effects that poses can tell of this robot, and those left out.
fn effects(arguments: &PosesArguments, robot: &RobotModel, site: &Site) -> Named {
    let heaviest = site.payloads.iter().copied().fold(0.0, f64::max);
    let data = Measurements {
        joints: robot.joints(),
        q: vec![0.0; robot.joints()],
        position: vec![Vector3::zeros()],
        sigma: vec![Vector3::zeros()],
        payload: vec![heaviest],
        ..Measurements::default()
    };
    let setting = setting();
    let (mut kept, mut left) = (Vec::new(), Vec::new());
    for effect in identified().filter_map(|cause| cause.whole(&setting)) {
        if arguments.effects.is_empty() || arguments.effects.iter().any(|name| name == effect.name()) {
            match effect.missing(robot, &data) {
                Some(reason) => left.push((effect.name(), reason)),
                None => kept.push(effect.name()),
            }
        }
    }
    (kept, left)
}

fn setting() -> Setting {
    Setting { base: Pose::identity(), load: Load::GravityTorque }
}

fn model(robot: &RobotModel, effects: &[&str]) -> Model {
    let setting = setting();
    let made = effects.iter().filter_map(|name| whole(name, &setting)).collect();
    Model::nominal(robot.clone(), EffectStack::new(robot, setting.base, made))
}
