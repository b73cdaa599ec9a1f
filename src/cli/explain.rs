//! `calib explain`: why a stage ran, or did not.

use super::surroundings::open_store;
use super::{emit, emit_json};
use crate::audit::explain;
use crate::error::Result;
use crate::pipeline::find_run;
use crate::summary;
use clap::Args;
use std::path::PathBuf;

/// Explain why a stage ran, or did not: which part of what it depends on changed since the run before.
#[derive(Args)]
#[command(after_help = "Examples:
  calib explain stiffness
  calib explain stiffness --run HEAD~3

Whether a stage would run now, and why: calib run PIPELINE --dry-run")]
pub(super) struct ExplainArguments {
    /// The stage's id
    stage: String,
    /// The run to explain
    #[arg(long, value_name = "RUN", default_value = "HEAD")]
    run: String,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

pub(super) fn main(arguments: &ExplainArguments) -> Result<()> {
    let store = open_store(arguments.store.as_deref())?;
    let explanation = explain(&store, &find_run(&store, &arguments.run)?, &arguments.stage)?;
    if arguments.json {
        return emit_json(&explanation);
    }
    emit(&summary::explanation(&explanation))
}
