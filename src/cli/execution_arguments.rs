//! What every verb that runs a pipeline, or takes its result, may be told: overrides, the store, worker threads.

use super::surroundings::{cores, open_store, surroundings};
use crate::error::Result;
use crate::pipeline::{
    CompletedRun, Override, Plan, Purpose, RunOptions, Selection, checked_plan, run,
};
use crate::progress::{Progress, Verbosity};
use crate::shell::typed;
use crate::store::Store;
use clap::Args;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct ExecutionArguments {
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
    /// Where tables and records are kept: a folder or s3://BUCKET/PREFIX [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
}

/// What a pipeline is run for, how much of it, and how much of its progress is shown.
pub(super) struct CommandTask {
    pub purpose: Purpose,
    pub selection: Selection,
    pub shown: Verbosity,
}

/// As much as `--quiet` and `--details` ask for.
pub(super) fn shown(quiet: bool, details: bool) -> Verbosity {
    match (quiet, details) {
        (true, _) => Verbosity::Quiet,
        (_, true) => Verbosity::Detailed,
        _ => Verbosity::Normal,
    }
}

impl ExecutionArguments {
    /// Reads a pipeline. Fails with every fault of its YAML and of the robot file at once.
    pub fn plan(&self, pipeline: &Path) -> Result<Plan> {
        self.plan_with(pipeline, &[])
    }

    /// The same with more overrides, behind those of the command line.
    pub fn plan_with(&self, pipeline: &Path, more: &[Override]) -> Result<Plan> {
        checked_plan(pipeline, &[&self.set, more].concat())
    }

    pub fn store(&self) -> Result<Store> {
        open_store(self.store.as_deref())
    }

    /// Whether anything is to be set on the command line.
    pub fn overrides(&self) -> bool {
        !self.set.is_empty()
    }

    /// `--store` as it was given, to be typed again; empty for the usual place.
    pub fn store_again(&self) -> String {
        self.store.as_ref().map_or_else(String::new, |store| {
            format!(" --store {}", typed(&store.display().to_string()))
        })
    }

    pub fn jobs(&self) -> usize {
        self.jobs.map_or_else(cores, usize::from)
    }

    /// Runs the selected stages; with as much progress as is to be shown.
    pub fn run(
        &self,
        plan: &Plan,
        store: &Store,
        task: CommandTask,
        command_line: &[OsString],
    ) -> Result<CompletedRun> {
        let CommandTask {
            purpose,
            selection,
            shown,
        } = task;
        let progress = Progress::new(
            shown,
            plan.stages
                .iter()
                .map(|stage| stage.id.len())
                .max()
                .unwrap_or(0),
        );
        let options = RunOptions {
            selection,
            jobs: self.jobs(),
            purpose,
        };
        let result = run(
            plan,
            store,
            &options,
            &surroundings(command_line),
            &progress,
        );
        progress.finish();
        result
    }
}
