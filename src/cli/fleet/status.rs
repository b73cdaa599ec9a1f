//! `calib fleet status` and `cancel`.
//!
//! `calib fleet render`: the job files of a run, to submit by hand.

use crate::cli::fleet::cluster::ClusterArguments;
use crate::cli::fleet::run::{self, count, ledger};
use crate::cli::fleet::{FleetLocation, first_line, records, workshop};
use crate::cli::surroundings::surroundings;
use crate::cli::{emit, emit_json};
use crate::error::{Error, Result, counted, visible};
use crate::fleet::{Ending, Fleet, FleetFile, RobotRecord, cluster};
use crate::text::filled;
use clap::{Args, ValueEnum};
use minijinja::context;
use minijinja::value::Serde;
use serde_json::json;
use std::ffi::OsString;

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
#[command(after_help = "Examples:
  calib fleet cancel FLEET.yaml")]
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
        let bad = records.iter().flatten();
        let bad = bad.filter(|record| record.ending != Ending::Done);
        let lines = bad.map(|record| {
            let (robot, ending) = (visible(&record.robot), record.ending.name());
            format!("{robot}: {ending}: {}\n", first_line(record))
        });
        let (name, robots) = (fleet.name(), counted(records.len(), "robot"));
        let all = format!(
            "fleet {name}: {done} of {robots} done, {rejected} rejected, {failed} failed, {missing} not computed yet\n"
        );
        emit(&(lines.collect::<String>() + &all))
    }
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
        cluster::cancel(&note.jobs)?;
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
