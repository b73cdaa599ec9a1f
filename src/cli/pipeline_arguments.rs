//! What every verb that runs a pipeline takes, and how it fails under `--json`.

use super::emit_json;
use super::execution_arguments::{CommandTask, ExecutionArguments, shown};
use crate::error::{Error, Fault, Result};
use crate::pipeline::{CompletedRun, Override, Plan, Purpose, Selection};
use crate::stage::{DeclaredStage, Report};
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
    #[command(flatten)]
    means: ExecutionArguments,
    /// Prints one JSON document on stdout
    #[arg(long)]
    pub json: bool,
    /// Prints no progress; warnings and errors remain
    #[arg(long, short)]
    quiet: bool,
}

impl PipelineArguments {
    /// The pipeline, its reports in another language where one is given.
    pub fn plan(&self, language: Option<&str>) -> Result<Plan> {
        let plan = self.means.plan(&self.pipeline)?;
        let Some(language) = language else {
            return Ok(plan);
        };
        let reports = plan
            .stages
            .iter()
            .filter(|stage| stage.entry.name == Report::NAME);
        let sets: Vec<Override> = reports
            .map(|stage| Override {
                target: format!("{}.language", stage.id),
                value: language.into(),
            })
            .collect();
        if sets.is_empty() {
            return Err(Error::spec(
                "--language",
                format!(
                    "{} has no stage `{}`",
                    self.pipeline.display(),
                    Report::NAME
                ),
            ));
        }
        self.means.plan_with(&self.pipeline, &sets)
    }

    /// See [`ExecutionArguments::store_again`].
    pub fn store_again(&self) -> String {
        self.means.store_again()
    }

    pub fn store(&self) -> Result<Store> {
        self.means.store()
    }

    /// Runs the selected stages with progress, and with `details` all that stages note.
    pub fn run(
        &self,
        plan: &Plan,
        store: &Store,
        wanted: (Selection, bool),
        command_line: &[OsString],
    ) -> Result<CompletedRun> {
        let (selection, details) = wanted;
        let task = CommandTask {
            purpose: Purpose::Run,
            selection,
            shown: shown(self.quiet, details),
        };
        self.means.run(plan, store, task, command_line)
    }

    /// The result, whose failure is also a document where one is asked for.
    pub fn reported<T>(&self, result: Result<T>) -> Result<T> {
        reported_as(self.json, result)
    }
}

/// A result, whose failure is also a document under `json`.
pub(super) fn reported_as<T>(json: bool, result: Result<T>) -> Result<T> {
    if let (true, Err(error)) = (json, &result) {
        emit_json(&failure(error))?;
    }
    result
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
