//! `calib log`: the runs of a store, the last first.
//!
//! `calib show`: one run, or one stage of it, in full.

use super::surroundings::open_store;
use super::{emit, emit_json};
use crate::error::{Error, Result};
use crate::pipeline::{Manifest, RunStatus, StageStatus, find_run};
use crate::store::Store;
use crate::summary::{self, status};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// List the runs, the last first: when, what for, which pipeline, how it ended.
///
/// A `run` is a complete one: `calib run` with the tables of every stage. A `partial` one stopped short of that by --only or --until, `failed`
/// and `unfinished` ones did not end; `compensate`, `export`, `diagnose`, `simulate` and `fleet` ran what that verb needed.
#[derive(Args)]
#[command(after_help = "Examples:
  calib log
  calib log --pipeline sr210d --limit 5

Other commands take a run by its id, the beginning or end of its id, a tag, HEAD for the\nlast complete run, or HEAD~2 for the complete run two before that.")]
pub(super) struct LogArguments {
    /// Runs of this pipeline only
    #[arg(long, value_name = "NAME")]
    pipeline: Option<String>,
    /// Runs to show; 0 shows all
    #[arg(long, value_name = "N", default_value_t = 20)]
    limit: usize,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl LogArguments {
    pub fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let tags = store.tags()?;
        // Where there is none, or a manifest is damaged, the list says so in its lines.
        let head = find_run(&store, "HEAD").ok();
        let (mut text, mut rows, mut shown) = (String::new(), Vec::new(), 0);
        for run in store.runs()?.into_iter().rev() {
            if self.limit > 0 && shown == self.limit {
                text.push_str("older ones: --limit 0\n");
                break;
            }
            let own: Vec<&str> = tags
                .iter()
                .filter(|(_, tagged)| **tagged == run)
                .map(|(tag, _)| tag.as_str())
                .collect();
            let is_head = head.as_ref() == Some(&run);
            match Manifest::of(&store, &run) {
                Ok(manifest)
                    if self
                        .pipeline
                        .as_ref()
                        .is_some_and(|name| name != &manifest.pipeline.name) =>
                {
                    continue;
                }
                Ok(manifest) => {
                    let names: Vec<&str> = is_head
                        .then_some("HEAD")
                        .into_iter()
                        .chain(own.iter().copied())
                        .collect();
                    let [executed, cached] = counts(&store, &manifest);
                    text.push_str(&line(&manifest, [executed, cached], &names));
                    rows.push(json!({
                    "run": run, "started": manifest.started, "what": manifest.what(), "pipeline": manifest.pipeline.name, "status": manifest.status,
                    "wall_seconds": manifest.wall_seconds, "executed": executed,
                    "cached": cached, "tags": own, "head": is_head, "error": manifest.error,
                }));
                }
                Err(error) => {
                    text.push_str(&format!("{run}  {error}\n"));
                    rows.push(json!({ "run": run, "status": "unreadable", "error": error.to_string(), "tags": own }));
                }
            }
            shown += 1;
        }
        if self.json {
            return emit_json(&rows);
        }
        emit(if shown == 0 { "no runs\n" } else { &text })
    }
}

fn line(manifest: &Manifest, [executed, cached]: [usize; 2], tags: &[&str]) -> String {
    let status = status(manifest);
    let seconds = manifest
        .wall_seconds
        .map_or_else(String::new, |seconds| format!("  {seconds:.1} s"));
    let tags = if tags.is_empty() {
        String::new()
    } else {
        format!("  [{}]", tags.join(", "))
    };
    format!(
        "{}  {:.16}  {:10}  {}  {status}, {executed} run, {cached} cached{seconds}{tags}\n",
        manifest.run_id,
        manifest.started,
        manifest.what(),
        manifest.pipeline.name
    )
}

/// How many stages were executed, and how many cached. The manifest of a run that did not end is older than its events.
fn counts(store: &Store, manifest: &Manifest) -> [usize; 2] {
    let events = if manifest.status == RunStatus::Running {
        store.events(&manifest.run_id)
    } else {
        Vec::new()
    };
    [StageStatus::Executed, StageStatus::Cached].map(|status| {
        let ended = events
            .iter()
            .filter(|event| event["event"] == "ends" && event["detail"]["status"] == json!(status))
            .count();
        manifest
            .stages
            .iter()
            .filter(|stage| stage.status == status)
            .count()
            .max(ended)
    })
}

/// Show a run: its pipeline, what was overridden, who ran it where, and every stage; or one stage with its inputs and tables.
#[derive(Args)]
#[command(after_help = "Examples:
  calib show HEAD
  calib show HEAD~1/geometry
  calib show released --json > manifest.json
  calib show released --yaml > as_it_was_run.yaml")]
pub(super) struct ShowArguments {
    /// A run, as `calib log` names it, or RUN/STAGE
    #[arg(value_name = "RUN[/STAGE]", default_value = "HEAD")]
    run: String,
    /// Prints the run's YAML as it was read, comments included
    #[arg(long, conflicts_with = "json")]
    yaml: bool,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints the manifest as it is
    #[arg(long)]
    json: bool,
}

impl ShowArguments {
    pub fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let (run, stage) = match self.run.split_once('/') {
            Some((run, stage)) => (run, Some(stage)),
            None => (self.run.as_str(), None),
        };
        let run = find_run(&store, run)?;
        let manifest = Manifest::of(&store, &run)?;
        let Some(id) = stage else {
            return match (self.yaml, self.json) {
                (true, _) => emit(&manifest.pipeline.text),
                (_, true) => emit_json(&store.manifest(&run)?),
                _ => emit(&summary::run(&manifest)),
            };
        };
        let Some(stage) = manifest.stage(id) else {
            let ids: Vec<&str> = manifest
                .stages
                .iter()
                .map(|stage| stage.id.as_str())
                .collect();
            return Err(Error::spec(
                format!("stage {id}"),
                format!(
                    "run {run} has no such stage; its stages: {}",
                    ids.join(", ")
                ),
            ));
        };
        if self.json {
            return emit_json(stage);
        }
        emit(&summary::stage(stage))
    }
}
