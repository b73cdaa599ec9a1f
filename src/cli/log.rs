//! `calib log`: the runs of a store, the last first.

use super::surroundings::open_store;
use super::{emit, emit_json};
use crate::error::Result;
use crate::pipeline::{Manifest, RunStatus, StageStatus, find_run};
use crate::store::Store;
use crate::summary::status;
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

pub(super) fn main(arguments: &LogArguments) -> Result<()> {
    let store = open_store(arguments.store.as_deref())?;
    let tags = store.tags()?;
    // Where there is none, or a manifest is damaged, the list says so in its lines.
    let head = find_run(&store, "HEAD").ok();
    let (mut text, mut rows, mut shown) = (String::new(), Vec::new(), 0);
    for run in store.runs()?.into_iter().rev() {
        if arguments.limit > 0 && shown == arguments.limit {
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
                if arguments
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
    if arguments.json {
        return emit_json(&rows);
    }
    emit(if shown == 0 { "no runs\n" } else { &text })
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
