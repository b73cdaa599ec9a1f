//! `calib fleet exec`: the one command that a cluster runs; idempotent, and silent about names.

use super::super::emit;
use super::super::surroundings::surroundings;
use super::{run, workshop};
use crate::error::{Error, Result, counted};
use crate::fleet::{Fleet, local};
use crate::progress::{FleetProgress, Verbosity};
use clap::Args;
use std::ffi::OsString;
use std::path::PathBuf;

/// Compute the robots of one task of a run.
#[derive(Args)]
pub(super) struct ExecArguments {
    #[arg(long, value_name = "DIR")]
    store: PathBuf,
    #[arg(long, value_name = "NAME")]
    fleet: String,
    #[arg(long, value_name = "ID")]
    run: String,
    #[arg(long, value_name = "N")]
    task: usize,
}

pub(super) fn main(arguments: &ExecArguments, command_line: &[OsString]) -> Result<()> {
    let store = super::folder(&arguments.store)?;
    let ledger = run::ledger(&store, &arguments.fleet);
    let note = ledger.run(Some(&arguments.run))?;
    let note = note.ok_or_else(|| {
        Error::store(
            &arguments.run,
            "no such run in the store, or not yet visible here",
        )
    })?;
    let tasks = note.tasks.len();
    let robots = note
        .tasks
        .get(arguments.task)
        .ok_or_else(|| Error::spec("--task", format!("the run has {}", counted(tasks, "task"))))?;
    let fleet = Fleet::load(&note.file, &store)?;
    // By name: the roster may have grown since.
    let names = robots
        .iter()
        .filter_map(|index| note.robots.get(*index))
        .map(|member| member.name.as_str());
    let chosen: Vec<usize> = names
        .filter_map(|name| fleet.roster.position(name))
        .collect();
    let fresh = || surroundings(command_line);
    let mut workshop = workshop(&fleet, &store, &fresh);
    let told = |name: &str| std::env::var(name).ok();
    workshop.name = told("SLURMD_NODENAME").unwrap_or(workshop.name);
    let task = told("SLURM_ARRAY_JOB_ID").zip(told("SLURM_ARRAY_TASK_ID"));
    workshop.round.clone_from(&note.round);
    workshop.log = task.map(|(job, task)| format!("{job}_{task}.out"));
    let progress = FleetProgress::new(Verbosity::Normal, 1, chosen.len());
    let stop = || workshop.ledger.cancelled(&note.run);
    let worked = local::work(
        &workshop,
        &chosen,
        &local::WorkerOptions {
            workers: 1,
            fail_fast: false,
            stop: &stop,
        },
        &progress,
    )?;
    let recorded = worked.records.iter().flatten().count();
    emit(&format!(
        "{recorded} of {} recorded, {} computed here\n",
        counted(robots.len(), "robot"),
        worked.computed
    ))?;
    if recorded < robots.len() {
        return Err(Error::store(
            &arguments.run,
            "not all robots of this task are recorded",
        ));
    }
    Ok(())
}
