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
