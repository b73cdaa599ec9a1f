//! `calib simulate`: recordings of a robot whose truth is known.
//!
//! `calib simulate record`: a pipeline's twin as the files that a user has.
//!
//! `calib simulate conceal`: case folders with hidden effects, and their truth sealed apart.

use crate::cli::pipeline_arguments::{CommandTask, ExecutionArguments, shown};
use crate::cli::surroundings::cores;
use crate::cli::{emit, emit_json};
use crate::error::{Error, Fault, Result, counted, nearest};
use crate::pipeline::{CompletedRun, Override, Plan, Purpose, Selection};
use crate::proof::{RECORDINGS, SEAL, conceal, recorded, vacant};
use crate::stage::{DeclaredStage, STAGES, Simulate};
use crate::store::Store;
use crate::table::{Recording, Robot, Table, Truth};
use crate::twin::conceal::design::Design;
use crate::twin::conceal::family::Collection;
use crate::twin::conceal::points::LAYOUTS;
use crate::twin::conceal::robots::{ALL_KINDS, Kind};
use crate::twin::tracker::SCATTERS;
use clap::{Args, Subcommand, ValueEnum};
use serde_json::json;
use std::ffi::OsString;
use std::path::PathBuf;

mod prove;

/// Make recordings of a simulated robot: with stated or hidden effects; and mark what a diagnosis made of them.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate record pipelines/sr210d/pipeline.yaml --out cell
  calib simulate conceal --out cases --seed 6 --cases 1 --family zero_shift")]
pub(super) struct SimulateArguments {
    #[command(subcommand)]
    verb: SimulateVerb,
}

#[derive(Subcommand)]
enum SimulateVerb {
    Record(RecordArguments),
    Conceal(ConcealArguments),
    Reveal(prove::RevealArguments),
    Prove(prove::ProveArguments),
}

impl SimulateArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        match &self.verb {
            SimulateVerb::Record(verb) => verb.run(command_line),
            SimulateVerb::Conceal(verb) => verb.run(),
            SimulateVerb::Reveal(verb) => verb.run(),
            SimulateVerb::Prove(verb) => verb.run(),
        }
    }
}

/// Record an experiment on a robot with stated effects.
///
/// Runs the stage `simulate` of a pipeline and what it needs, and writes what a user of that robot would have: robot.json,
/// controller.csv and tracker.csv, or of a ball at fixtures a file of joints under the name of each; and next to them truth.csv with every
/// true number. Joints and points keep 9 decimals, joints at fixtures 12.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate record pipelines/sr210d/pipeline.yaml --out sr210d
  calib simulate record twin.yaml --out monday --set seed=7 --set simulate.remainder=none")]
pub(crate) struct RecordArguments {
    /// The pipeline's YAML file, with a stage `simulate`
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    /// The folder to make; it must not exist, or be empty
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress
    #[arg(long, short)]
    quiet: bool,
}

impl RecordArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let place = self.pipeline.display().to_string();
        let plan = Plan::load(&self.pipeline, &self.set, STAGES)?;
        let mut stages = plan.stages.iter();
        let Some(stage) = stages.position(|stage| stage.entry.name == Simulate::NAME) else {
            return Err(Error::spec(place, "has no stage `simulate`"));
        };
        vacant(&self.out)?;
        let plan = plan.needed_for(stage);
        let last = plan.stages.last();
        let moves = last.is_some_and(|last| last.stage.settings().get("motion").is_some());
        let means = ExecutionArguments::of(&self.set, self.store.as_deref());
        let store = means.store()?;
        let task = CommandTask {
            purpose: Purpose::Simulate,
            selection: Selection::default(),
            shown: shown(self.quiet, false),
        };
        let outcome = means.run(&plan, &store, task, command_line)?;
        let robot = table::<Robot>(&outcome, &store)?.to_description()?;
        let (recording, truth): (Recording, Truth) =
            (table(&outcome, &store)?, table(&outcome, &store)?);
        let rows = recording.rows();
        let files = recorded(&robot, recording, &truth, moves)
            .map_err(|fault| Error::spec(&place, fault))?;
        let fault =
            |error: std::io::Error| Error::store(self.out.display().to_string(), error.to_string());
        std::fs::create_dir_all(&self.out).map_err(fault)?;
        for (name, text) in files {
            let file = self.out.join(name);
            let folder = file.parent().map_or(Ok(()), std::fs::create_dir_all);
            let written = folder.and_then(|()| std::fs::write(file, text));
            written.map_err(fault)?;
        }
        if self.json {
            return emit_json(
                &json!({ "folder": self.out.to_string_lossy(), "points": rows, "true_numbers": truth.0.len() }),
            );
        }
        emit(&format!(
            "{}, {}: {}\n",
            counted(rows, "point"),
            counted(truth.0.len(), "true number"),
            self.out.display()
        ))
    }
}

fn table<T: Table>(outcome: &CompletedRun, store: &Store) -> Result<T> {
    let last = outcome.manifest.tables(T::KIND).last();
    let output =
        last.ok_or_else(|| Error::Bug(format!("a simulation without a table {}", T::KIND)))?;
    T::from_frame(&store.load(&output.table)?)
}

/// Make recordings in which effects are hidden, and seal the truth.
///
/// DIR/recordings/CASE holds what a user has: robot.json, controller.csv, tracker.csv. DIR/sealed/CASE.json holds the truth, and
/// DIR/seal.json the SHA-256 of every file. The same seed gives the same bytes. Effects are made by other mathematics than those
/// that `diagnose` knows, many in other forms, and sized so that they range from hardly visible to plain.
///
/// With --dynamics recordings are torques or motor currents of an arm that moves (robot.json, recording.csv), for
/// `calib diagnose pipelines/dynamics/pipeline.yaml`; most joints have friction in addition to the concealed effects.
///
/// With --drives recordings are commands and angles of position-controlled joints (robot.xml, drives.json, recording.csv), for
/// `calib diagnose pipelines/drives/pipeline.yaml`.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate conceal --out blind --seed 7 --cases 40 --nulls 0.25
  calib simulate conceal --out gears --cases 20 --family gear_cyclic,backlash --robot sr210d --points 200
  calib simulate conceal --out pairs --seed 3 --cases 30 --pairs 1
  calib simulate conceal --out strange --cases 30 --open 1
  calib simulate conceal --out further --cases 30 --families beyond
  calib simulate conceal --out moving --cases 30 --dynamics --nulls 0.2 --pairs 0.2
  calib simulate conceal --out servos --cases 30 --drives --nulls 0.2 --pairs 0.2")]
pub(crate) struct ConcealArguments {
    /// The folder to make; it must not exist, or be empty
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The same seed gives the same recordings
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Recordings to make
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=9999))]
    cases: u32,
    /// Torques of an arm that moves instead of points
    #[arg(long, conflicts_with_all = OF_POINTS)]
    dynamics: bool,
    /// Commands and angles of position-controlled joints instead of points
    #[arg(long, conflicts_with_all = OF_POINTS, conflicts_with = "dynamics")]
    drives: bool,
    /// Seconds of a recording of torques: 55 % are to fit, the rest judges
    #[arg(long, value_name = "S", default_value_t = 48.0, requires = "dynamics")]
    seconds: f64,
    /// Rows a second of a recording of torques
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 100.0,
        requires = "dynamics"
    )]
    rate: f64,
    /// The list that effects are drawn from
    #[arg(long, value_enum, value_name = "LIST", default_value_t = Families::Library)]
    families: Families,
    /// Effects to draw from, by canonical name [default: all]
    #[arg(long, value_name = "EFFECT,..", value_delimiter = ',')]
    family: Vec<String>,
    /// Robots to draw from: sr210d, compact6, seven7r, five5r [default: the first three; beyond the library all]
    #[arg(long, value_name = "ROBOT,..", value_delimiter = ',')]
    robot: Vec<String>,
    /// Points to fit; 25 to 50 % of them are added to validate [default: 50 to 400]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(20..=20_000))]
    points: Option<u32>,
    /// Share of recordings without any effect
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    nulls: f64,
    /// Share of recordings with two effects
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    pairs: f64,
    /// Share of recordings with an effect that is in no list
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    open: f64,
    /// Share of recordings with a foreign effect: drawn at random, any motion over any variable
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    foreign: f64,
    /// Share of effects in another form than the obvious one
    #[arg(long, value_name = "SHARE", default_value_t = 0.5)]
    other_forms: f64,
    /// Share of effects of natural size; others are sized to a drawn visibility
    #[arg(long, value_name = "SHARE", default_value_t = 0.2)]
    natural: f64,
    /// Share of recordings with gross errors or exchanged points
    #[arg(long, value_name = "SHARE", default_value_t = 0.08)]
    faulty: f64,
    /// How trackers scatter: gaussian, student (heavy tails), uneven, wandering (0.9 from point to point), directional (2.5 to 1)
    /// [default: gaussian, of nulls also student and uneven; beyond the library mostly gaussian]
    #[arg(long, value_name = "FORM")]
    scatter: Option<String>,
    /// As most cells have it: robot files without masses, nothing on the tool, no motor currents
    #[arg(long)]
    bare: bool,
    /// Rounds the logged joints to steps of this size, deg
    #[arg(long, value_name = "DEG", default_value_t = 0.0)]
    log_step: f64,
    /// How poses follow each other: random, path (one after the other along lines and curves), shuffled (those of the same paths in random
    /// order)
    #[arg(long, value_name = "FORM", default_value = "random")]
    layout: String,
    /// A mass on the flange, kg, that neither the robot file nor the payload column states
    #[arg(long, value_name = "KG", default_value_t = 0.0)]
    tool_mass: f64,
    /// Worker threads; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    pub(crate) json: bool,
}

/// Options that only recordings of points have. They are refused by name with torques and drives: a set that ignored one would be another
/// set than was asked for, and its score would be believed.
const OF_POINTS: [&str; 10] = [
    "families", "family", "robot", "points", "natural", "faulty", "scatter", "bare", "log_step",
    "layout",
];

/// The lists of effects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Families {
    /// Effects of the library, from hardly visible to plain
    Library,
    /// Instruments, memory and interactions: one cause a recording, L of 50 to 200
    Beyond,
}

impl ConcealArguments {
    pub(crate) fn threads(&self) -> usize {
        self.jobs.map_or_else(cores, usize::from)
    }

    pub(crate) fn run(&self) -> Result<()> {
        let design = design(self)?;
        vacant(&self.out)?;
        let rows = conceal(&self.out, &design, self.threads())?;
        let moves = self.dynamics || self.drives;
        let row = if moves { "row" } else { "point" };
        let (recordings, seal) = (self.out.join(RECORDINGS), self.out.join(SEAL));
        if self.json {
            let rows_of = format!("{row}s");
            return emit_json(
                &json!({ "cases": design.cases, (rows_of): rows, "recordings": recordings, "seal": seal }),
            );
        }
        let (cases, rows) = (counted(design.cases, "recording"), counted(rows, row));
        let (recordings, seal) = (recordings.display(), seal.display());
        emit(&format!("{cases}, {rows}: {recordings}\nseal: {seal}\n"))
    }
}

/// The design that the options state; fails with every fault of them.
pub(crate) fn design(arguments: &ConcealArguments) -> Result<Design> {
    let mut faults = Vec::new();
    let mut wrong = |is_wrong: bool, option: &str, message: String| {
        faults.extend(is_wrong.then(|| Fault::new(option, message)));
    };
    let share = |option, value| (option, value, [0.0, 1.0], [" is no share", ""]);
    let tool = [" is no mass of a tool", " kg"];
    for (option, value, [least, most], [what, unit]) in [
        share("--nulls", arguments.nulls),
        share("--pairs", arguments.pairs),
        share("--open", arguments.open),
        share("--foreign", arguments.foreign),
        share("--other-forms", arguments.other_forms),
        share("--natural", arguments.natural),
        share("--faulty", arguments.faulty),
        ("--seconds", arguments.seconds, [16.0, 3600.0], ["", ""]),
        ("--rate", arguments.rate, [20.0, 5000.0], ["", ""]),
        ("--tool-mass", arguments.tool_mass, [0.0, 500.0], tool),
        (
            "--log-step",
            arguments.log_step,
            [0.0, 1.0],
            [" is no step of a log", " deg"],
        ),
    ] {
        let message = format!("{value}{what}; allowed: {least} to {most}{unit}");
        wrong(!(least..=most).contains(&value), option, message);
    }
    let singled = arguments.pairs + arguments.open + arguments.foreign;
    let collection = match arguments.families {
        Families::Library => Collection::Library,
        Families::Beyond => Collection::Beyond,
    };
    wrong(
        arguments.nulls + singled > 1.0 + 1e-9,
        "--nulls, --pairs, --open, --foreign",
        "add up to more than 1".into(),
    );
    wrong(
        (arguments.dynamics || arguments.drives) && arguments.foreign > 0.0,
        "--foreign",
        "foreign effects move points; torques and drives have none".into(),
    );
    wrong(
        collection == Collection::Beyond && singled > 0.0,
        "--pairs, --open, --foreign",
        "need `--families library`; with `--families beyond` every recording has one cause".into(),
    );
    let mut names: Vec<(&str, ())> = Vec::new();
    for family in collection.families() {
        if !names.contains(&(family.name, ())) {
            names.push((family.name, ()));
        }
    }
    for name in &arguments.family {
        named("--family", name, &names, &mut faults);
    }
    let kinds = ALL_KINDS.map(|kind| (kind.name(), kind));
    let chosen = arguments.robot.iter();
    let chosen = chosen.filter_map(|name| named("--robot", name, &kinds, &mut faults));
    let chosen: Vec<Kind> = chosen.collect();
    let scatters = SCATTERS.map(|one| (one.name(), one));
    let scatter = arguments.scatter.as_deref();
    let scatter = scatter.and_then(|name| named("--scatter", name, &scatters, &mut faults));
    let layouts = LAYOUTS.map(|one| (one.name(), one));
    let layout = named("--layout", &arguments.layout, &layouts, &mut faults);
    Error::if_spec(faults)?;
    Ok(Design {
        seed: arguments.seed,
        cases: arguments.cases as usize,
        collection,
        families: arguments.family.clone(),
        robots: ALL_KINDS
            .into_iter()
            .filter(|kind| chosen.contains(kind))
            .collect(),
        points: arguments.points.map(|points| points as usize),
        nulls: arguments.nulls,
        pairs: arguments.pairs,
        open: arguments.open,
        foreign: arguments.foreign,
        other_forms: arguments.other_forms,
        natural: arguments.natural,
        faulty: arguments.faulty,
        scatter,
        bare: arguments.bare,
        log_step_deg: arguments.log_step,
        layout: layout.unwrap_or_default(),
        tool_mass_kg: arguments.tool_mass,
        dynamics: arguments.dynamics,
        drives: arguments.drives,
        seconds: arguments.seconds,
        rate: arguments.rate,
    })
}

/// The one of this name; a fault where there is none.
fn named<T: Copy>(
    option: &str,
    name: &str,
    all: &[(&str, T)],
    faults: &mut Vec<Fault>,
) -> Option<T> {
    let found = all.iter().find(|(known, _)| *known == name);
    if found.is_none() {
        let allowed: Vec<&str> = all.iter().map(|(known, _)| *known).collect();
        let hint = match nearest(name, allowed.iter().copied()) {
            Some(near) => format!("; did you mean `{near}`?"),
            None => ".".into(),
        };
        let message = format!("no `{name}`{hint} Allowed: {}", allowed.join(", "));
        faults.push(Fault::new(option, message));
    }
    found.map(|(_, one)| *one)
}
