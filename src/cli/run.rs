//! `calib run`: runs what is not already done.

use super::surroundings::{cores, default_store, surroundings};
use super::{emit, emit_json, searches, tables};
use crate::error::{Error, Fault, Result};
use crate::pipeline::{Forecast, Outcome, Override, Plan, Prospect, RunOptions, Selection, StageStatus, preview, run};
use crate::progress::{Progress, Verbosity};
use crate::stage::STAGES;
use crate::store::Store;
use clap::Args;
use serde_json::json;
use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Instant;

/// Run a pipeline: every stage that is not already done, in order.
///
/// A stage is done when its settings, its input tables and files, its seed and its implementation are those of an earlier
/// run; then its tables are taken as they are. A run that was killed goes on where it stood when the same command is given
/// again. The result is on stdout, progress on stderr.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct RunArguments {
    /// The pipeline's YAML file
    #[arg(value_name = "PIPELINE")]
    pipeline: PathBuf,
    /// Overrides a variable, the seed, or a setting of a stage; may be given several times
    #[arg(long, value_name = "TARGET=VALUE", value_parser = Override::parse)]
    set: Vec<Override>,
    /// Shows what would run and why, and runs nothing
    #[arg(long, short = 'n')]
    dry_run: bool,
    /// Runs this stage alone; those before it must be cached
    #[arg(long, value_name = "STAGE", conflicts_with_all = ["from", "until"])]
    only: Option<String>,
    /// Runs this stage and those after it; those before it must be cached
    #[arg(long, value_name = "STAGE")]
    from: Option<String>,
    /// Runs up to and with this stage
    #[arg(long, value_name = "STAGE")]
    until: Option<String>,
    /// Runs again though cached: all selected stages, or this one (give it after PIPELINE)
    #[arg(long, value_name = "STAGE", num_args = 0..=1, default_missing_value = "")]
    force: Option<Vec<String>>,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Worker threads; no result depends on it [default: all cores]
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
    /// Prints no progress; warnings and errors remain
    #[arg(long, short)]
    quiet: bool,
}

const EXAMPLES: &str = "Examples:
  calib run pipelines/sr210d/pipeline.yaml
  calib run pipelines/case/pipeline.yaml --set case=recordings/robot-7
  calib run pipeline.yaml --set seed=7 --set split.every=5 --dry-run
  calib run pipeline.yaml --from stiffness --force
  calib run pipeline.yaml --json --quiet > result.json";

pub(super) fn main(arguments: &RunArguments, command_line: &[OsString]) -> Result<()> {
    let result = execute(arguments, command_line);
    if let (true, Err(error)) = (arguments.json, &result) {
        emit_json(&failure(error))?;
    }
    result
}

fn execute(arguments: &RunArguments, command_line: &[OsString]) -> Result<()> {
    let begun = Instant::now();
    let plan = Plan::load(&arguments.pipeline, &arguments.set, STAGES)?;
    let store = Store::open(arguments.store.clone().unwrap_or_else(default_store))?;
    // `--force` without a stage stands for all of them.
    let force = arguments.force.as_ref().map(|ids| ids.iter().filter(|id| !id.is_empty()).cloned().collect());
    let selection =
        Selection { only: arguments.only.clone(), from: arguments.from.clone(), until: arguments.until.clone(), force };
    if arguments.dry_run {
        let forecasts = preview(&plan, &store, &selection)?;
        return if arguments.json {
            emit_json(&json!({ "pipeline": plan.name, "stages": forecasts }))
        } else {
            emit(&forecast_lines(&forecasts))
        };
    }
    let verbosity = if arguments.quiet { Verbosity::Quiet } else { Verbosity::Normal };
    let progress = Progress::new(verbosity, plan.stages.iter().map(|stage| stage.id.len()).max().unwrap_or(0));
    let options = RunOptions { selection, jobs: arguments.jobs.map_or_else(cores, usize::from) };
    let result = run(&plan, &store, &options, &surroundings(command_line), &progress);
    progress.finish();
    let outcome = result?;
    if arguments.json {
        return emit_json(&document(&outcome, &store)?);
    }
    let mut text = tables::statistics(&outcome, &store)?;
    text.push_str(&searches::searches(&outcome, &store)?);
    text.push_str(&tables::rejected(&outcome));
    for path in &outcome.documents {
        text.push_str(&format!("report: {}\n", path.display()));
    }
    text.push_str(&closing(&outcome, begun.elapsed().as_secs_f64()));
    emit(&text)
}

fn closing(outcome: &Outcome, seconds: f64) -> String {
    let stages = &outcome.manifest.stages;
    let count = |status| stages.iter().filter(|stage| stage.status == status).count();
    if outcome.nothing_done() {
        return format!("nothing to do: all {} stages are cached ({seconds:.1} s)\n", stages.len());
    }
    let (executed, cached, not_run) = (count(StageStatus::Executed), count(StageStatus::Cached), count(StageStatus::NotRun));
    let not_run = if not_run > 0 { format!(", {not_run} not selected") } else { String::new() };
    format!("done: {executed} stages run, {cached} cached{not_run} ({seconds:.1} s), run {}\n", outcome.manifest.run_id)
}

fn forecast_lines(forecasts: &[Forecast]) -> String {
    let width = forecasts.iter().map(|forecast| forecast.id.len()).max().unwrap_or(0);
    let line = |forecast: &Forecast| {
        let what = match &forecast.prospect {
            Prospect::Cached => "cached".into(),
            Prospect::Run { reason } => format!("run ({reason})"),
            Prospect::Pending { on } => format!("pending (depends on {on})"),
            Prospect::NotSelected => "not selected".into(),
        };
        format!("{:width$}  {what}\n", forecast.id)
    };
    forecasts.iter().map(line).collect()
}

/// The result of a run for other programs.
fn document(outcome: &Outcome, store: &Store) -> Result<serde_json::Value> {
    let manifest = &outcome.manifest;
    let stages: Vec<serde_json::Value> = manifest
        .stages
        .iter()
        .map(|stage| {
            let outputs = stage.outputs.iter().map(|output| {
                json!({
                    "port": output.port, "kind": output.kind, "rows": output.table.rows,
                    "table_hash": output.table.table_hash, "path": output.path,
                })
            });
            json!({
                "id": stage.id, "uses": stage.uses, "status": stage.status, "reason": stage.reason,
                "outputs": outputs.collect::<Vec<_>>(), "notes": stage.notes, "warnings": stage.warnings,
                "wall_seconds": stage.wall_seconds,
            })
        })
        .collect();
    Ok(json!({
        "status": "done",
        "run_id": manifest.run_id,
        "pipeline": manifest.pipeline.name,
        "seed": manifest.seed,
        "stages": stages,
        "statistics": tables::statistics_json(outcome, store)?,
        "searches": searches::searches_json(outcome, store)?,
        "rejected_rows": tables::rejected_rows(outcome),
        "report": outcome.documents.first(),
        "documents": outcome.documents,
    }))
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
