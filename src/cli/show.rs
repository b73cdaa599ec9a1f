//! `calib show`: one run, or one stage of it, in full.

use super::surroundings::open_store;
use super::{emit, emit_json};
use crate::error::{Error, Result};
use crate::pipeline::{Manifest, find_run};
use crate::summary;
use clap::Args;
use std::path::PathBuf;

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

pub(super) fn main(arguments: &ShowArguments) -> Result<()> {
    let store = open_store(arguments.store.as_deref())?;
    let (run, stage) = match arguments.run.split_once('/') {
        Some((run, stage)) => (run, Some(stage)),
        None => (arguments.run.as_str(), None),
    };
    let run = find_run(&store, run)?;
    let manifest = Manifest::of(&store, &run)?;
    let Some(id) = stage else {
        return match (arguments.yaml, arguments.json) {
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
    if arguments.json {
        return emit_json(stage);
    }
    emit(&summary::stage(stage))
}
