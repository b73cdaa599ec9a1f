//! `calib fleet`: one pipeline over many robots, on this machine or on a cluster.

mod cluster;
mod diagnose;
mod run;
mod status;

use super::surroundings::{bucket, default_store};
use crate::error::{Error, Fault, Result, counted, visible};
use crate::fleet::{Ending, Fleet, Ledger, RobotRecord, Workshop};
use crate::pipeline::Surroundings;
use crate::store::Store;
use clap::{Args, Subcommand};
use rayon::prelude::*;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Run one pipeline over many robots: fleet files, workers, the state of each, tables and a page.
#[derive(Args)]
#[command(after_help = "Examples:
  calib fleet run FLEET.yaml
  calib fleet diagnose FLEET.yaml
  calib fleet status FLEET.yaml --robot r7")]
pub(super) struct FleetArguments {
    #[command(subcommand)]
    verb: FleetVerb,
}

#[derive(Subcommand)]
enum FleetVerb {
    Run(run::FleetRunArguments),
    Diagnose(diagnose::FleetDiagnoseArguments),
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
    pub fn run(&self, command_line: &[OsString]) -> Result<()> {
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
    let all = || records.iter().flatten();
    let bad = |ending: Ending| all().filter(move |record| record.ending == ending);
    let line = |record: &RobotRecord| {
        let message = format!("{}: {}", record.ending.name(), first_line(record));
        Fault::new(visible(&record.robot), message)
    };
    let all_bad: Vec<&RobotRecord> = bad(Ending::Failed).chain(bad(Ending::Rejected)).collect();
    let mut faults: Vec<Fault> = all_bad
        .iter()
        .take(NAMED)
        .map(|record| line(record))
        .collect();
    if all_bad.len() > NAMED {
        let message = format!(
            "and {} more: see `calib fleet status`",
            all_bad.len() - NAMED
        );
        faults.push(Fault::new("", message));
    }
    let list = |faults: &[Fault]| {
        let lines = faults.iter().map(Fault::to_string);
        lines.collect::<Vec<_>>().join("\n")
    };
    if bad(Ending::Failed).any(|record| record.exit_code == 70) {
        return Err(Error::Bug(list(&faults)));
    }
    let missing = records.iter().filter(|record| record.is_none()).count();
    if missing > 0 {
        let robots = counted(records.len(), "robot");
        let message = format!("not computed yet: {missing} of {robots}; run again");
        faults.push(Fault::new("", message));
    }
    if missing > 0 || bad(Ending::Failed).next().is_some() {
        return Err(Error::store(fleet.name(), list(&faults)));
    }
    Error::if_data(faults)
}

/// Why a robot is not done.
fn first_line(record: &RobotRecord) -> String {
    let reason = record
        .reason
        .as_deref()
        .and_then(|reason| reason.lines().next());
    visible(reason.unwrap_or_default())
}
