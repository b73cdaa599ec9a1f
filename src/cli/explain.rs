//! `calib explain`: why a stage ran, or did not.

use super::surroundings::open_store;
use super::{emit, emit_json, show};
use crate::audit::{Explanation, explain};
use crate::error::{Error, Result};
use crate::pipeline::{StageStatus, find_run};
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
        return emit_json(&serde_json::to_value(&explanation).map_err(|error| Error::Bug(error.to_string()))?);
    }
    emit(&text(&explanation))
}

fn text(explanation: &Explanation) -> String {
    let stage = &explanation.stage;
    let mut text = format!("{} in run {}: {}", stage.id, explanation.run, show::word(stage));
    match (stage.status, &stage.reason) {
        (StageStatus::Cached, _) => text.push_str(", all that it depends on was the same as in an earlier run\n"),
        (_, Some(reason)) => text.push_str(&format!(", because: {reason}\n")),
        (_, None) => text.push('\n'),
    }
    let Some(before) = &explanation.before else {
        return text + "no earlier run of this pipeline had this stage\n";
    };
    if explanation.changes.is_empty() {
        return text + &format!("nothing that it depends on changed since run {before}\n");
    }
    text.push_str(&format!("since run {before}:\n"));
    for change in &explanation.changes {
        let writer = explanation.writers.iter().find(|(port, _)| change.what == "input" && *port == change.name);
        let writer = writer.map_or_else(String::new, |(_, from)| format!(", written by {from}"));
        let value = |value: &str| {
            let cut: String = value.chars().take(60).collect();
            // Of hashes the beginning says enough.
            let hash = value.len() == 64 && value.chars().all(|c| c.is_ascii_hexdigit());
            if hash {
                value[..12].to_string()
            } else if cut.len() < value.len() {
                format!("{cut}…")
            } else {
                cut
            }
        };
        text.push_str(&format!(
            "  {} {}: {} -> {}{writer}\n",
            change.what,
            change.name,
            value(&change.before),
            value(&change.now)
        ));
    }
    text
}
