//! What every verb that runs a pipeline takes, and how it fails under `--json`.

use super::emit_json;
use super::surroundings::{cores, default_store, surroundings};
use crate::error::{Error, Fault, Result};
use crate::pipeline::{Outcome, Override, Plan, RunOptions, Selection, run};
use crate::progress::{Progress, Verbosity};
use crate::stage::STAGES;
use crate::store::Store;
use clap::Args;
use serde_json::json;
use std::ffi::OsString;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct PipelineArguments {
    /// The pipeline's YAML file
    #[arg(value_name = "PIPELINE")]
    pub pipeline: PathBuf,
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    pub json: bool,
    /// Prints no progress; warnings and errors remain
    #[arg(long, short)]
    quiet: bool,
}

impl PipelineArguments {
    pub fn plan(&self) -> Result<Plan> {
        Plan::load(&self.pipeline, &self.set, STAGES)
    }

    pub fn store(&self) -> Result<Store> {
        Store::open(self.store.clone().unwrap_or_else(default_store))
    }

    /// Runs the selected stages with progress.
    pub fn run(&self, plan: &Plan, store: &Store, selection: Selection, command_line: &[OsString]) -> Result<Outcome> {
        let verbosity = if self.quiet { Verbosity::Quiet } else { Verbosity::Normal };
        let progress = Progress::new(verbosity, plan.stages.iter().map(|stage| stage.id.len()).max().unwrap_or(0));
        let options = RunOptions { selection, jobs: self.jobs.map_or_else(cores, usize::from) };
        let result = run(plan, store, &options, &surroundings(command_line), &progress);
        progress.finish();
        result
    }

    /// The result, whose failure is also a document where one is asked for.
    pub fn told(&self, result: Result<()>) -> Result<()> {
        if let (true, Err(error)) = (self.json, &result) {
            emit_json(&failure(error))?;
        }
        result
    }
}

fn failure(error: &Error) -> serde_json::Value {
    let fault = |fault: &Fault| json!({ "place": fault.place, "message": fault.message });
    let faults: Vec<serde_json::Value> = match error {
        Error::Spec(faults) | Error::Data(faults) => faults.iter().map(fault).collect(),
        Error::Store(only) => vec![fault(only)],
        Error::Bug(message) => vec![json!({ "place": "", "message": message })],
    };
    json!({ "status": "failed", "exit_code": error.exit_code(), "faults": faults })
}
