//! `calib fleet status` and `cancel`.
//!
//! `calib fleet render`: the job files of a run, to submit by hand.
//!
//! `calib fleet diagnose`: causes that the robots of a model have in common.

use crate::cli::fleet::run::{self, Engine, count, ledger, note, sound};
use crate::cli::fleet::{ClusterArguments, FleetLocation, on_slurm, records, workshop};
use crate::cli::surroundings::{cores, surroundings};
use crate::cli::{emit, emit_json};
use crate::error::{Error, Result, counted, visible};
use crate::fleet::causes::{self, CauseSearch, Published};
use crate::fleet::round::GroupColumn;
use crate::fleet::{Ending, Fleet, FleetFile, RobotRecord, cluster, local, slurm};
use crate::progress::{FleetProgress, Verbosity};
use crate::text::filled;
use clap::{Args, ValueEnum};
use minijinja::context;
use minijinja::value::Serde;
use serde_json::json;
use std::ffi::OsString;
use std::time::Instant;

/// Show the state of every robot, or of one: its record, its run and its tables.
#[derive(Args)]
#[command(after_help = "Examples:
  calib fleet status FLEET.yaml
  calib fleet status FLEET.yaml --robot r7")]
pub(super) struct StatusArguments {
    #[command(flatten)]
    place: FleetLocation,
    /// One robot, in detail
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

/// Stop the latest run after the robots in hand, and take its jobs from the cluster.
#[derive(Args)]
pub(super) struct CancelArguments {
    #[command(flatten)]
    place: FleetLocation,
}

impl StatusArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let store = self.place.store()?;
        let fleet = Fleet::load(&self.place.fleet, &store)?;
        let fresh = || surroundings(command_line);
        let workshop = workshop(&fleet, &store, &fresh);
        if let Some(name) = &self.robot {
            let position = fleet
                .roster
                .position(name)
                .ok_or_else(|| Error::spec("--robot", format!("no robot {name:?} in the fleet")))?;
            let record = workshop.record(&fleet.roster.0[position])?;
            return match (record, self.json) {
                (Some(record), true) => emit_json(&json!(record)),
                (Some(record), false) => emit(&detail(&record, &store, fleet.name())),
                (None, true) => emit_json(&json!({ "robot": name, "ending": "missing" })),
                (None, false) => emit(&format!(
                    "{}: not computed yet for its settings and data as they are\n",
                    visible(name)
                )),
            };
        }
        let records = records(&workshop)?;
        let missing = records.iter().filter(|record| record.is_none()).count();
        let [done, rejected, failed] =
            [Ending::Done, Ending::Rejected, Ending::Failed].map(|ending| count(&records, ending));
        if self.json {
            let robots = fleet.roster.0.iter().zip(&records).map(|(robot, record)| {
            let ending = record.as_ref().map_or("missing", |record| record.ending.name());
            json!({ "robot": robot.name, "status": ending, "reason": record.as_ref().and_then(|record| record.reason.clone()) })
        });
            let robots: Vec<_> = robots.collect();
            return emit_json(&json!({
                "fleet": fleet.name(), "done": done, "rejected": rejected, "failed": failed, "missing": missing, "robots": robots,
            }));
        }
        let mut text = String::new();
        for record in records
            .iter()
            .flatten()
            .filter(|record| record.ending != Ending::Done)
        {
            text.push_str(&format!(
                "{}: {}: {}\n",
                visible(&record.robot),
                record.ending.name(),
                first_line(record)
            ));
        }
        text.push_str(&format!(
        "fleet {}: {done} of {} done, {rejected} rejected, {failed} failed, {missing} not computed yet\n",
        fleet.name(),
        counted(records.len(), "robot")
    ));
        emit(&text)
    }
}

fn first_line(record: &RobotRecord) -> String {
    visible(
        record
            .reason
            .as_deref()
            .and_then(|reason| reason.lines().next())
            .unwrap_or_default(),
    )
}

fn detail(record: &RobotRecord, store: &crate::store::Store, fleet: &str) -> String {
    let logs = || crate::fleet::cluster::logs(store.root(), fleet);
    let log = record
        .log
        .as_ref()
        .map(|log| logs().join(log).display().to_string());
    let runs = store.root().join("runs");
    let run = record.run.as_ref();
    let manifest = run.map(|run| runs.join(run).join("manifest.json").display().to_string());
    let written = run.and_then(|run| store.manifest(run).ok());
    let stages = written.as_ref().map(|manifest| &manifest["stages"]);
    let tables = record.tables.iter().map(|made| {
        let name = format!("{}.{}", made.stage, made.port);
        (
            name,
            made.table.rows,
            store.object_path(&made.table).display().to_string(),
        )
    });
    let about = context! {
        of => Serde(record), ending => record.ending.name(), log, manifest,
        reason => Serde(record.reason.iter().flat_map(|reason| reason.lines()).collect::<Vec<_>>()),
        stages => Serde(stages), tables => Serde(tables.collect::<Vec<_>>()),
    };
    filled(include_str!("robot.txt"), about)
}

pub(super) fn cancel(arguments: &CancelArguments) -> Result<()> {
    let store = arguments.place.store()?;
    let (file, _) = FleetFile::load(&arguments.place.fleet)?;
    let ledger = ledger(&store, &file.name);
    let note = ledger
        .run(None)?
        .ok_or_else(|| Error::spec(&file.name, "the fleet has no run in this store"))?;
    ledger.cancel(&note.run)?;
    if note.engine == "slurm" {
        slurm::cancel(&note.jobs)?;
    }
    emit(&format!(
        "run {} stops after the robots in hand; `calib fleet run` goes on where it stood\n",
        note.run
    ))
}

/// Print the job files for the robots that have no record yet, and submit nothing.
#[derive(Args)]
#[command(after_help = "Examples:
  calib fleet render FLEET.yaml --engine slurm --store /shared/store > jobs.sh
  calib fleet render FLEET.yaml --engine k8s --store /store --image calib:0.2 --claim robots > job.yaml")]
pub(super) struct RenderArguments {
    #[command(flatten)]
    place: FleetLocation,
    #[arg(long, value_enum)]
    engine: Scheduler,
    #[command(flatten)]
    cluster: ClusterArguments,
    /// Container image of calib
    #[arg(
        long,
        value_name = "IMAGE",
        default_value = "calib",
        help_heading = "Cluster"
    )]
    image: String,
    /// Persistent volume claim that holds the store and the recordings
    #[arg(
        long,
        value_name = "NAME",
        default_value = "calib",
        help_heading = "Cluster"
    )]
    claim: String,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Scheduler {
    /// Scripts for sbatch
    Slurm,
    /// An Indexed Job of Kubernetes (experimental)
    K8s,
}

impl RenderArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let store = self.place.store()?;
        let fleet = Fleet::load(&self.place.fleet, &store)?;
        let fresh = || surroundings(command_line);
        let workshop = workshop(&fleet, &store, &fresh);
        let mut note = run::note(&fleet, &self.place, &fresh().run_id)?;
        let missing: Vec<usize> = (0..)
            .zip(records(&workshop)?)
            .filter(|(_, record)| record.is_none())
            .map(|(k, _)| k)
            .collect();
        if missing.is_empty() {
            return Err(Error::spec(
                fleet.name(),
                "every robot is recorded: nothing to submit",
            ));
        }
        note.tasks = self.cluster.tasks(&missing);
        let options = self.cluster.options(store.root())?;
        let text: String = match self.engine {
            Scheduler::Slurm => {
                note.engine = "slurm".into();
                cluster::slurm(&note, &options)?.concat()
            }
            Scheduler::K8s => {
                note.engine = "k8s".into();
                cluster::kubernetes(&note, &options, &self.image, &self.claim)
            }
        };
        // The tasks find their robots there.
        workshop.ledger.put_run(&note)?;
        let folder = cluster::logs(&options.store, fleet.name());
        std::fs::create_dir_all(&folder)
            .map_err(|error| Error::store(folder.display().to_string(), error.to_string()))?;
        emit(&text)
    }
}

/// Find the causes that robots of a model have in common, though each recording is too small to tell them from chance.
///
/// The evidence of every possible cause is summed over the robots of a group, round after round, with the settings of the pipeline's stage
/// `diagnose`; sizes stay each robot's own. Then causes of single robots, robots that lack what all others have, and robots of another
/// size are listed. The same command again goes on where it stood.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FleetDiagnoseArguments {
    #[command(flatten)]
    place: FleetLocation,
    /// Label of the roster by which robots are grouped
    #[arg(long, value_enum, default_value_t = By::Model)]
    by: By,
    /// Robots at once on this machine; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Where the robots are computed
    #[arg(long, value_enum, default_value_t = Engine::Local)]
    engine: Engine,
    #[command(flatten)]
    cluster: ClusterArguments,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum By {
    /// Model of the robot
    Model,
    /// Where it stands
    Plant,
    /// Date of the measurement
    Campaign,
}

const EXAMPLES: &str = "Examples:
  calib fleet diagnose FLEET.yaml
  calib fleet diagnose FLEET.yaml --by plant -j 2 --json";

/// Rounds after which a search ends whatever it finds.
const ROUNDS: usize = 40;

impl FleetDiagnoseArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        let begun = Instant::now();
        let store = self.place.store()?;
        let fleet = Fleet::load(&self.place.fleet, &store)?;
        let fresh = || surroundings(command_line);
        let mut workshop = workshop(&fleet, &store, &fresh);
        let by = match self.by {
            By::Model => GroupColumn::Model,
            By::Plant => GroupColumn::Plant,
            By::Campaign => GroupColumn::Campaign,
        };
        let mut search = CauseSearch::new(by);
        workshop.round = Some(search.round().clone());
        sound(&workshop)?;
        let chosen: Vec<usize> = (0..fleet.roster.0.len()).collect();
        let verbosity = if self.quiet {
            Verbosity::Quiet
        } else {
            Verbosity::Normal
        };
        let mut computed = 0;
        let last = loop {
            let mut note = note(&fleet, &self.place, &fresh().run_id)?;
            note.round.clone_from(&workshop.round);
            let slurm = self.engine == Engine::Slurm;
            let workers = self.jobs.map_or_else(cores, usize::from);
            let shown = if slurm { 0 } else { workers };
            let progress = FleetProgress::new(verbosity, shown, chosen.len());
            let records = if slurm {
                note.engine = "slurm".into();
                let waited = on_slurm(&workshop, &mut note, &chosen, &self.cluster, &progress);
                let Some(now) = waited? else {
                    return emit(
                        "submitted the robots of one round; the same command again goes on\n",
                    );
                };
                computed += now;
                records(&workshop)?
            } else {
                workshop.ledger.put_run(&note)?;
                let options = local::WorkerOptions {
                    workers,
                    fail_fast: false,
                    stop: &|| workshop.ledger.cancelled(&note.run),
                };
                let worked = local::work(&workshop, &chosen, &options, &progress)?;
                computed += worked.computed;
                worked.records
            };
            let missing = records.iter().filter(|record| record.is_none()).count();
            if missing > 0 {
                let message = format!("{} not computed yet; run again", counted(missing, "robot"));
                return Err(Error::store(fleet.name(), message));
            }
            let goes_on = search.take(&fleet, &workshop.ledger, &records)?;
            let found = search.so_far();
            progress.say(&format!(
                "round {}: {} given now{}{}",
                search.rounds,
                counted(found.len(), "cause"),
                if found.is_empty() { "" } else { ": " },
                found.join(", ")
            ));
            progress.finish();
            if !goes_on || search.rounds >= ROUNDS {
                break records;
            }
            workshop.round = Some(search.round().clone());
        };
        let made = causes::publish(&fleet, &workshop.ledger, &search, &last)?;
        let seconds = begun.elapsed().as_secs_f64();
        if self.json {
            let rejected = last
                .iter()
                .flatten()
                .filter(|record| record.ending != Ending::Done);
            return emit_json(&json!({
                "fleet": fleet.name(), "robots": last.len(), "not_asked": rejected.count(), "rounds": search.rounds, "computed": computed,
                "wall_seconds": seconds, "findings": made.answers.findings.0, "outliers": made.answers.outliers.0,
                "tables": made.tables.iter().map(|path| path.to_string_lossy()).collect::<Vec<_>>(), "page": made.page.to_string_lossy(),
            }));
        }
        emit(&text(&made, last.len(), search.rounds, computed, seconds))
    }
}

/// Sentences of each kind that the terminal shows; the tables have all.
const SHOWN: usize = 20;

fn text(made: &Published, robots: usize, rounds: usize, computed: usize, seconds: f64) -> String {
    let findings = made.answers.findings.0.iter();
    let shared: Vec<_> = findings.filter(|row| row.robot.is_empty()).collect();
    let outliers = &made.answers.outliers.0;
    let about = context! {
        shared => Serde(shared), outliers => Serde(&outliers[..outliers.len().min(SHOWN)]),
        more => outliers.len().saturating_sub(SHOWN), page => made.page.display().to_string(),
        tables => made.tables.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
        robots, rounds, computed, seconds,
    };
    filled(include_str!("causes.txt"), about)
}
