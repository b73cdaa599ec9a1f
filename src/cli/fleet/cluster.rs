//! Where robots are computed, here or on a cluster: what is asked of it, and the wait for their records.

use super::super::surroundings::{cores, program};
use super::records;
use crate::error::{Error, Fault, Result, counted};
use crate::fleet::cluster::{self, ClusterOptions, Waited};
use crate::fleet::ledger::RunNote;
use crate::fleet::work::{self, FleetResults};
use crate::fleet::{Ending, Workshop};
use crate::progress::{FleetProgress, Verbosity};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct ClusterArguments {
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
    pub(super) fn options(&self, store: &std::path::Path) -> Result<ClusterOptions> {
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

    /// Robots by task.
    pub(super) fn tasks(&self, robots: &[usize]) -> Vec<Vec<usize>> {
        robots
            .chunks(self.robots_per_task as usize)
            .map(<[usize]>::to_vec)
            .collect()
    }
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Engine {
    /// Threads of this process
    Local,
    /// Arrays of jobs on a Slurm cluster that shares the store
    Slurm,
}

/// Who computes robots.
#[derive(Args)]
pub(super) struct EngineArguments {
    /// Robots at once on this machine; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Where the robots are computed
    #[arg(long, value_enum, default_value_t = Engine::Local)]
    engine: Engine,
    #[command(flatten)]
    cluster: ClusterArguments,
}

impl EngineArguments {
    /// Bars on a terminal, of so many robots.
    pub(super) fn progress(&self, quiet: bool, robots: usize) -> FleetProgress {
        let verbosity = match quiet {
            true => Verbosity::Quiet,
            false => Verbosity::Normal,
        };
        let workers = match self.engine {
            Engine::Local => self.workers(),
            Engine::Slurm => 0,
        };
        FleetProgress::new(verbosity, workers, robots)
    }

    fn workers(&self) -> usize {
        self.jobs.map_or_else(cores, usize::from)
    }

    /// Computes robots that have no record; gives the records of the whole fleet, or nothing where the wait is the person's.
    pub(super) fn work(
        &self,
        workshop: &Workshop,
        note: &mut RunNote,
        chosen: &[usize],
        fail_fast: bool,
        progress: &FleetProgress,
    ) -> Result<Option<FleetResults>> {
        if self.engine == Engine::Slurm {
            note.engine = "slurm".into();
            let Some(computed) = on_slurm(workshop, note, chosen, &self.cluster, progress)? else {
                return Ok(None);
            };
            let records = records(workshop)?;
            return Ok(Some(FleetResults { records, computed }));
        }
        workshop.ledger.put_run(note)?;
        let options = work::WorkerOptions {
            workers: self.workers(),
            fail_fast,
            stop: &|| workshop.ledger.cancelled(&note.run),
        };
        let mut worked = work::work(workshop, chosen, &options, progress)?;
        // Of robots outside of what was asked for, what is known stays known.
        if worked.records.iter().any(Option::is_none) {
            worked.records = records(workshop)?;
        }
        Ok(Some(worked))
    }
}

/// Submits what has no record and waits for it; gives how many were computed, or nothing where the wait is the person's.
fn on_slurm(
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
        cluster::submit(&workshop.ledger, note, &options)?;
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
        let waited = cluster::wait(&note.jobs, look, &|| workshop.ledger.cancelled(&note.run))?;
        left = missing()?.0;
        match waited {
            Waited::Complete => break,
            Waited::Stopped => {
                cluster::cancel(&note.jobs)?;
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
