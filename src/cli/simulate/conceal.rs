//! `calib simulate conceal`: case folders with hidden effects, and their truth sealed apart.

use super::super::surroundings::cores;
use super::super::{emit, emit_json};
use crate::error::{Error, Fault, Result, counted, nearest};
use crate::proof::{ConcealedSet, RECORDINGS, SEAL, conceal, vacant};
use crate::twin::conceal::design::Design;
use crate::twin::conceal::family::Collection;
use crate::twin::conceal::layout::LAYOUTS;
use crate::twin::conceal::robots::ALL_KINDS;
use crate::twin::torque::TorqueDesign;
use crate::twin::tracker::SCATTERS;
use clap::{Args, ValueEnum};
use serde_json::json;
use std::path::PathBuf;

/// Make recordings in which effects are hidden, and seal the truth.
///
/// DIR/recordings/CASE holds what a user has: robot.json, controller.csv, tracker.csv. DIR/sealed/CASE.json holds the truth, and
/// DIR/seal.json the SHA-256 of every file. The same seed gives the same bytes. Effects are made by other mathematics than those
/// that `diagnose` knows, many in other forms, and sized so that they range from hardly visible to plain.
///
/// With --dynamics recordings are torques or motor currents of an arm that moves (robot.json, recording.csv), for
/// `calib diagnose pipelines/dynamics/pipeline.yaml`; most joints have friction beside what is concealed.
#[derive(Args)]
#[command(after_help = "Examples:
  calib simulate conceal --out blind --seed 7 --cases 40 --nulls 0.25
  calib simulate conceal --out gears --cases 20 --family gear_cyclic,backlash --robot sr210d --points 200
  calib simulate conceal --out pairs --seed 3 --cases 30 --pairs 1
  calib simulate conceal --out strange --cases 30 --open 1
  calib simulate conceal --out further --cases 30 --families beyond
  calib simulate conceal --out moving --cases 30 --dynamics --nulls 0.2 --pairs 0.2")]
pub(super) struct ConcealArguments {
    /// The folder to make; it must not exist, or be empty
    #[arg(long, short, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// The same seed gives the same recordings
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Recordings to make
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=9999))]
    cases: u32,
    /// Torques of an arm that moves instead of points
    #[arg(long, conflicts_with_all = OF_POINTS)]
    dynamics: bool,
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
    pub(super) json: bool,
}

/// Options that only recordings of points have.
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
    pub(super) fn threads(&self) -> usize {
        self.jobs.map_or_else(cores, usize::from)
    }
}

impl ConcealArguments {
    pub fn run(&self) -> Result<()> {
        let design = design(self)?;
        vacant(&self.out)?;
        let rows = conceal(&self.out, &design, self.threads())?;
        let row = if self.dynamics { "row" } else { "point" };
        let (recordings, seal) = (self.out.join(RECORDINGS), self.out.join(SEAL));
        if self.json {
            return emit_json(
                &json!({ "cases": design.cases(), (format!("{row}s")): rows, "recordings": recordings, "seal": seal }),
            );
        }
        emit(&format!(
            "{}, {}: {}\nseal: {}\n",
            counted(design.cases(), "recording"),
            counted(rows, row),
            recordings.display(),
            seal.display()
        ))
    }
}

/// The design that the options state; fails with every fault of them.
pub(super) fn design(arguments: &ConcealArguments) -> Result<ConcealedSet> {
    if arguments.dynamics {
        torques(arguments)
    } else {
        points(arguments)
    }
}

/// Faults of the shares that both kinds of recordings have.
fn shares(arguments: &ConcealArguments) -> Vec<Fault> {
    let shares = [
        ("--nulls", arguments.nulls),
        ("--pairs", arguments.pairs),
        ("--open", arguments.open),
        ("--foreign", arguments.foreign),
        ("--other-forms", arguments.other_forms),
        ("--natural", arguments.natural),
        ("--faulty", arguments.faulty),
    ];
    let wrong = shares
        .into_iter()
        .filter(|(_, share)| !(0.0..=1.0).contains(share));
    let mut faults: Vec<Fault> = wrong
        .map(|(option, share)| Fault::new(option, format!("{share} is no share; allowed: 0 to 1")))
        .collect();
    if arguments.nulls + arguments.pairs + arguments.open + arguments.foreign > 1.0 + 1e-9 {
        faults.push(Fault::new(
            "--nulls, --pairs, --open, --foreign",
            "add up to more than 1",
        ));
    }
    faults
}

fn torques(arguments: &ConcealArguments) -> Result<ConcealedSet> {
    let mut faults = shares(arguments);
    for (option, value, [least, most]) in [
        ("--seconds", arguments.seconds, [16.0, 3600.0]),
        ("--rate", arguments.rate, [20.0, 5000.0]),
    ] {
        if !(least..=most).contains(&value) {
            faults.push(Fault::new(
                option,
                format!("{value}; allowed: {least} to {most}"),
            ));
        }
    }
    if arguments.foreign > 0.0 {
        faults.push(Fault::new(
            "--foreign",
            "foreign effects move points; torques have none",
        ));
    }
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    Ok(ConcealedSet::Torques(TorqueDesign {
        seed: arguments.seed,
        cases: arguments.cases as usize,
        nulls: arguments.nulls,
        pairs: arguments.pairs,
        open: arguments.open,
        other_forms: arguments.other_forms,
        seconds: arguments.seconds,
        rate: arguments.rate,
    }))
}

fn points(arguments: &ConcealArguments) -> Result<ConcealedSet> {
    let mut faults = shares(arguments);
    let collection = match arguments.families {
        Families::Library => Collection::Library,
        Families::Beyond => Collection::Beyond,
    };
    if collection == Collection::Beyond
        && arguments.pairs + arguments.open + arguments.foreign > 0.0
    {
        faults.push(Fault::new(
            "--pairs, --open, --foreign",
            "need `--families library`; with `--families beyond` every recording has one cause",
        ));
    }
    let mut allowed: Vec<&str> = Vec::new();
    for family in collection.families() {
        if !allowed.contains(&family.name) {
            allowed.push(family.name);
        }
    }
    let kinds: Vec<&str> = ALL_KINDS.iter().map(|kind| kind.name()).collect();
    for (option, names, allowed) in [
        ("--family", &arguments.family, &allowed),
        ("--robot", &arguments.robot, &kinds),
    ] {
        let wrong = names
            .iter()
            .filter(|name| !allowed.contains(&name.as_str()));
        faults.extend(wrong.map(|name| unknown(option, name, allowed)));
    }
    let scatter = arguments.scatter.as_deref();
    let scatter = scatter.and_then(|name| {
        named(
            "--scatter",
            name,
            SCATTERS.map(|one| (one.name(), one)),
            &mut faults,
        )
    });
    if !(0.0..=500.0).contains(&arguments.tool_mass) {
        faults.push(Fault::new(
            "--tool-mass",
            format!(
                "{} is no mass of a tool; allowed: 0 to 500 kg",
                arguments.tool_mass
            ),
        ));
    }
    let layout = named(
        "--layout",
        &arguments.layout,
        LAYOUTS.map(|one| (one.name(), one)),
        &mut faults,
    );
    if !(0.0..=1.0).contains(&arguments.log_step) {
        faults.push(Fault::new(
            "--log-step",
            format!(
                "{} is no step of a log; allowed: 0 to 1 deg",
                arguments.log_step
            ),
        ));
    }
    if !faults.is_empty() {
        return Err(Error::Spec(faults));
    }
    Ok(ConcealedSet::Positions(Box::new(Design {
        seed: arguments.seed,
        cases: arguments.cases as usize,
        collection,
        families: arguments.family.clone(),
        robots: ALL_KINDS
            .into_iter()
            .filter(|kind| arguments.robot.iter().any(|name| name == kind.name()))
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
    })))
}

/// The one of this name; a fault where there is none.
fn named<T: Copy, const N: usize>(
    option: &str,
    name: &str,
    all: [(&str, T); N],
    faults: &mut Vec<Fault>,
) -> Option<T> {
    let found = all.iter().find(|(known, _)| *known == name);
    if found.is_none() {
        faults.push(unknown(option, name, &all.map(|(known, _)| known)));
    }
    found.map(|(_, one)| *one)
}

fn unknown(option: &str, name: &str, allowed: &[&str]) -> Fault {
    let hint =
        nearest(name, allowed.iter().copied()).map(|near| format!("; did you mean `{near}`?"));
    Fault::new(
        option,
        format!(
            "no `{name}`{} Allowed: {}",
            hint.unwrap_or_else(|| ".".into()),
            allowed.join(", ")
        ),
    )
}
