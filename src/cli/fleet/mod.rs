//! `calib fleet`: one pipeline over many robots, on this machine or on a cluster.
//!
//! Robots on a cluster: what is asked of it, and the wait for their records.

use super::surroundings::program;
use crate::cli::surroundings::{bucket, default_store};
use crate::error::{Error, Fault, Result, counted, visible};
use crate::fleet::cluster::ClusterOptions;
use crate::fleet::ledger::RunNote;
use crate::fleet::slurm::{self, Waited};
use crate::fleet::{Ending, Fleet, Ledger, RobotRecord, Workshop};
use crate::pipeline::Surroundings;
use crate::progress::FleetProgress;
use crate::store::Store;
use clap::{Args, Subcommand};
use rayon::prelude::*;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

mod run;
mod status;

/// Run one pipeline over many robots: fleet files, workers, the state of each, tables and a page.
#[derive(Args)]
pub(super) struct FleetArguments {
    #[command(subcommand)]
    verb: FleetVerb,
}

#[derive(Subcommand)]
enum FleetVerb {
    Run(run::FleetRunArguments),
    Diagnose(status::FleetDiagnoseArguments),
    Status(status::StatusArguments),
    Retry(run::RetryArguments),
    Cancel(status::CancelArguments),
    Render(status::RenderArguments),
    #[command(hide = true)]
    Exec(run::ExecArguments),
}

/// What all verbs need.
#[derive(Args)]
struct FleetLocation {
    /// The fleet's YAML file
    #[arg(value_name = "FLEET")]
    fleet: PathBuf,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
}

impl FleetLocation {
    fn store(&self) -> Result<Store> {
        folder(&self.store.clone().unwrap_or_else(default_store))
    }
}

/// Opens the folder that all workers of a fleet share.
fn folder(store: &Path) -> Result<Store> {
    if bucket(store).is_some() {
        let message = "a fleet needs a folder that all its workers see; a robot alone runs with calib run --store s3://BUCKET/PREFIX";
        return Err(Error::spec("--store", message));
    }
    Store::open(store)
}

impl FleetArguments {
    pub(crate) fn run(&self, command_line: &[OsString]) -> Result<()> {
        match &self.verb {
            FleetVerb::Run(verb) => verb.run(command_line),
            FleetVerb::Diagnose(verb) => verb.run(command_line),
            FleetVerb::Status(verb) => verb.run(command_line),
            FleetVerb::Retry(verb) => run::retry(verb, command_line),
            FleetVerb::Cancel(verb) => status::cancel(verb),
            FleetVerb::Render(verb) => verb.run(command_line),
            FleetVerb::Exec(verb) => verb.run(command_line),
        }
    }
}

fn workshop<'a>(
    fleet: &'a Fleet,
    store: &'a Store,
    surroundings: &'a (dyn Fn() -> Surroundings + Sync),
) -> Workshop<'a> {
    let name = surroundings().host.name;
    Workshop {
        fleet,
        ledger: Ledger::new(store, fleet.name()),
        surroundings,
        name,
        log: None,
        threads: 1,
        round: None,
    }
}

/// The records of all robots as they are; none where a robot has none for its settings and data.
fn records(workshop: &Workshop) -> Result<Vec<Option<RobotRecord>>> {
    workshop
        .fleet
        .roster
        .0
        .par_iter()
        .map(|robot| workshop.record(robot))
        .collect()
}

/// Robots named in an error; the table has all.
const NAMED: usize = 20;

/// Nothing where all robots are done; else the worst of how they ended, with reasons.
fn verdict(fleet: &Fleet, records: &[Option<RobotRecord>]) -> Result<()> {
    let bad = |ending: Ending| {
        records
            .iter()
            .flatten()
            .filter(move |record| record.ending == ending)
    };
    let line = |record: &RobotRecord| {
        let reason = record
            .reason
            .as_deref()
            .and_then(|reason| reason.lines().next())
            .unwrap_or_default();
        Fault::new(
            visible(&record.robot),
            format!("{}: {}", record.ending.name(), visible(reason)),
        )
    };
    let mut faults: Vec<Fault> = bad(Ending::Failed)
        .chain(bad(Ending::Rejected))
        .take(NAMED)
        .map(line)
        .collect();
    let count = bad(Ending::Failed).count() + bad(Ending::Rejected).count();
    if count > NAMED {
        faults.push(Fault::new(
            "",
            format!("and {} more: see `calib fleet status`", count - NAMED),
        ));
    }
    let list = |faults: &[Fault]| {
        faults
            .iter()
            .map(Fault::to_string)
            .collect::<Vec<_>>()
            .join("\n")
    };
    if bad(Ending::Failed).any(|record| record.exit_code == 70) {
        return Err(Error::Bug(list(&faults)));
    }
    let missing = records.iter().filter(|record| record.is_none()).count();
    if missing > 0 {
        faults.push(Fault::new(
            "",
            format!(
                "not computed yet: {missing} of {}; run again",
                counted(records.len(), "robot")
            ),
        ));
    }
    if missing > 0 || bad(Ending::Failed).next().is_some() {
        return Err(Error::store(fleet.name(), list(&faults)));
    }
    if faults.is_empty() {
        Ok(())
    } else {
        Err(Error::Data(faults))
    }
}

#[derive(Args)]
pub(crate) struct ClusterArguments {
    /// Slurm's partition
    #[arg(long, value_name = "NAME", help_heading = "Cluster")]
    partition: Option<String>,
    /// Robots of one task, one after the other
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..), help_heading = "Cluster")]
    robots_per_task: u32,
    /// Tasks at once
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Cluster")]
    max_parallel: Option<u32>,
    /// Memory of a task, e.g. 2G
    #[arg(long, value_name = "SIZE", help_heading = "Cluster")]
    mem: Option<String>,
    /// Time of a task, e.g. 00:30:00
    #[arg(long, value_name = "TIME", help_heading = "Cluster")]
    time: Option<String>,
    /// Another option of sbatch, e.g. --sbatch-arg=--account=robots; may be given several times
    #[arg(
        long,
        value_name = "ARG",
        allow_hyphen_values = true,
        help_heading = "Cluster"
    )]
    sbatch_arg: Vec<String>,
    /// Times that robots whose tasks were lost are submitted again
    #[arg(long, value_name = "N", default_value_t = 3, help_heading = "Cluster")]
    resubmit: u32,
    /// Submits and returns; `calib fleet status` says how far it is, `run` again makes the tables
    #[arg(long, help_heading = "Cluster")]
    detach: bool,
}

impl ClusterArguments {
    /// What to ask of the cluster; paths as all nodes know them.
    pub(crate) fn options(&self, store: &std::path::Path) -> Result<ClusterOptions> {
        let fault = |error: std::io::Error| Error::store("--store", error.to_string());
        let program: PathBuf = program().map_err(fault)?;
        Ok(ClusterOptions {
            program,
            store: std::path::absolute(store).map_err(fault)?,
            partition: self.partition.clone(),
            max_parallel: self.max_parallel,
            memory: self.mem.clone(),
            time: self.time.clone(),
            more: self.sbatch_arg.clone(),
        })
    }

    pub(crate) fn tasks(&self, robots: &[usize]) -> Vec<Vec<usize>> {
        robots
            .chunks(self.robots_per_task as usize)
            .map(<[usize]>::to_vec)
            .collect()
    }
}

/// Submits what has no record and waits for it; gives how many were computed, or nothing where the wait is the person's.
pub(crate) fn on_slurm(
    workshop: &Workshop,
    note: &mut RunNote,
    chosen: &[usize],
    arguments: &ClusterArguments,
    progress: &FleetProgress,
) -> Result<Option<usize>> {
    let options = arguments.options(workshop.ledger.store.root())?;
    let robots = &workshop.fleet.roster.0;
    // What may work now is tried again.
    let keys: Vec<(usize, String)> = chosen
        .iter()
        .map(|index| (*index, workshop.key(&robots[*index])))
        .collect();
    for (_, key) in &keys {
        if workshop
            .ledger
            .find(key)?
            .is_some_and(|record| record.exit_code == crate::fleet::ledger::LATER)
        {
            workshop.ledger.forget(key)?;
        }
    }
    let missing = || -> Result<(Vec<usize>, usize)> {
        let (mut missing, mut bad) = (Vec::new(), 0);
        for (index, key) in &keys {
            match workshop.ledger.find(key)? {
                None => missing.push(*index),
                Some(record) => bad += usize::from(record.ending != Ending::Done),
            }
        }
        Ok((missing, bad))
    };
    let at_first = missing()?.0;
    let mut left = at_first.clone();
    let mut round = 0;
    while !left.is_empty() {
        note.tasks = arguments.tasks(&left);
        note.jobs.clear();
        slurm::submit(&workshop.ledger, note, &options)?;
        progress.say(&format!(
            "{} in {}: jobs {}",
            counted(left.len(), "robot"),
            counted(note.tasks.len(), "task"),
            note.jobs.join(", ")
        ));
        if arguments.detach {
            return Ok(None);
        }
        let look = || {
            let (missing, bad) = missing()?;
            progress.count(chosen.len() - missing.len(), bad);
            Ok(missing.len())
        };
        let waited = slurm::wait(&note.jobs, look, &|| workshop.ledger.cancelled(&note.run))?;
        left = missing()?.0;
        match waited {
            Waited::Complete => break,
            Waited::Stopped => {
                slurm::cancel(&note.jobs)?;
                break;
            }
            Waited::Gone if round >= arguments.resubmit => {
                let message = format!(
                    "without a record after {}: {}; see {}",
                    counted(round + 1, "round"),
                    counted(left.len(), "robot"),
                    log_folder(&options, note)
                );
                return Err(Error::Store(Fault::new("slurm", message)));
            }
            Waited::Gone => {
                round += 1;
                // Tasks of a new array need numbers of their own.
                note.run = (workshop.surroundings)().run_id;
                progress.say(&format!(
                    "submitted again, having no record and no task: {}",
                    counted(left.len(), "robot")
                ));
            }
        }
    }
    Ok(Some(at_first.len() - left.len()))
}

fn log_folder(options: &ClusterOptions, note: &RunNote) -> String {
    crate::fleet::cluster::logs(&options.store, &note.fleet)
        .display()
        .to_string()
}
