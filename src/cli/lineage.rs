//! `calib lineage`: where a table comes from, down to the raw files.
//!
//! `calib explain`: why a stage ran, or did not.

use super::surroundings::open_store;
use super::{emit, emit_json};
use crate::audit::{LineageNode, explain, lineage};
use crate::diff::table_hash;
use crate::error::{Error, Result, counted};
use crate::pipeline::{Manifest, find_run};
use crate::store::Store;
use crate::summary;
use clap::Args;
use std::path::{Path, PathBuf};

/// Trace a table: the stage and run that made it, its settings, its input tables, theirs, down to the raw files.
#[derive(Args)]
#[command(after_help = "Examples:
  calib lineage .calib/tables/sr210d/validate.statistics.parquet
  calib lineage HEAD/stiffness/parameters
  calib lineage 4f2a90c1")]
pub(super) struct LineageArguments {
    /// A table's file, RUN/STAGE/PORT, or the beginning of its content hash
    #[arg(value_name = "TABLE")]
    table: String,
    /// Where tables and records are kept [default: .calib in the working directory]
    #[arg(long, value_name = "DIR")]
    store: Option<PathBuf>,
    /// Prints one JSON document on stdout
    #[arg(long)]
    json: bool,
}

impl LineageArguments {
    pub fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let node = lineage(&store, &hash(&store, &self.table)?)?;
        if self.json {
            return emit_json(&node);
        }
        let mut text = String::new();
        lines(&node, "", 0, &mut text);
        emit(&text)
    }
}

fn hash(store: &Store, table: &str) -> Result<String> {
    if Path::new(table).is_file() {
        let found = table_hash(Path::new(table))?;
        return found
            .ok_or_else(|| Error::spec(table, "carries no content hash: calib did not write it"));
    }
    let parts: Vec<&str> = table.split('/').collect();
    let [run, stage, port] = parts[..] else {
        return Ok(table.into());
    };
    let manifest = Manifest::of(store, &find_run(store, run)?)?;
    let output = manifest
        .stage(stage)
        .and_then(|stage| stage.outputs.iter().find(|output| output.port == port));
    match output {
        Some(output) => Ok(output.table.table_hash.to_string()),
        None => Err(Error::spec(
            table,
            format!(
                "run {} has no such table; calib show {run}/{stage} lists a stage's",
                manifest.run_id
            ),
        )),
    }
}

fn lines(node: &LineageNode, port: &str, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    let port = if port.is_empty() {
        String::new()
    } else {
        format!("{port} <- ")
    };
    let hash: String = node.table_hash.as_str().chars().take(12).collect();
    let Some(made) = &node.made else {
        text.push_str(&format!(
            "{indent}{port}{hash}: the store has no record of who made it\n"
        ));
        return;
    };
    text.push_str(&format!(
        "{indent}{port}{}.{}  {hash}  {}",
        made.stage,
        made.port,
        counted(made.rows, "row")
    ));
    if made.shown_before {
        text.push_str("  (as above)\n");
        return;
    }
    text.push_str(&format!(
        "  by {} {} in run {}, {:.16}\n",
        made.uses, made.implementation, made.run, made.when
    ));
    for (name, hash) in &made.files {
        text.push_str(&format!("{indent}  file {name}  {hash:.12}\n"));
    }
    for (port, node) in &made.reads {
        lines(node, port, depth + 1, text);
    }
}

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

impl ExplainArguments {
    pub fn run(&self) -> Result<()> {
        let store = open_store(self.store.as_deref())?;
        let explanation = explain(&store, &find_run(&store, &self.run)?, &self.stage)?;
        if self.json {
            return emit_json(&explanation);
        }
        emit(&summary::explanation(&explanation))
    }
}
