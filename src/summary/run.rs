//! A run as its manifest has it, and a stage of it.
//!
//! Why a stage ran, or did not.
//!
//! A pipeline as it was understood: its stages, what they read and write.

use crate::audit::Explanation;
use crate::error::counted;
use crate::pipeline::{Manifest, Plan, RunStatus, StageReport, StageStatus};
use crate::store::TableRef;

/// A whole run.
pub fn run(manifest: &Manifest) -> String {
    let mut text = format!(
        "run {}, {}, {}\n",
        manifest.run_id,
        manifest.what(),
        status(manifest)
    );
    text.push_str(
        &manifest
            .error
            .as_ref()
            .map_or_else(String::new, |error| format!("error: {error}\n")),
    );
    let seconds = manifest
        .wall_seconds
        .map_or_else(String::new, |seconds| format!(", {seconds:.1} s"));
    let memory = manifest
        .peak_memory_bytes
        .map_or_else(String::new, |bytes| {
            format!(", {:.0} MB at most", bytes as f64 / 1e6)
        });
    text.push_str(&format!("started {}{seconds}{memory}\n", manifest.started));
    text.push_str(&format!(
        "pipeline {}, {}, seed {}\n",
        manifest.pipeline.name, manifest.pipeline.file, manifest.seed
    ));
    for set in &manifest.overrides {
        text.push_str(&format!(
            "set on the command line: {} = {}\n",
            set.target, set.value
        ));
    }
    let (tool, host) = (&manifest.tool, &manifest.host);
    let user = manifest
        .user
        .as_ref()
        .map_or_else(String::new, |user| format!("{user} on "));
    text.push_str(&format!(
        "{} {} on {user}{}, {} {}, {}\n",
        tool.name,
        tool.version,
        host.name,
        host.os,
        host.architecture,
        counted(manifest.jobs, "job")
    ));
    if let Some(previous) = &manifest.previous {
        text.push_str(&format!("after run {}\n", previous.run));
    }
    let width = manifest
        .stages
        .iter()
        .map(|stage| stage.id.len())
        .max()
        .unwrap_or(0);
    text.push('\n');
    for stage in &manifest.stages {
        let rows: Vec<String> = stage
            .outputs
            .iter()
            .map(|output| format!("{} {}", output.port, output.table.rows))
            .collect();
        let seconds = stage
            .wall_seconds
            .map_or_else(String::new, |seconds| format!("{seconds:.2} s"));
        text.push_str(&format!(
            "{:width$}  {:8}  {seconds:>9}  {}\n",
            stage.id,
            word(stage),
            rows.join(", ")
        ));
        text.push_str(&stage.reason.as_ref().map_or_else(String::new, |reason| {
            format!("{:width$}  because: {reason}\n", "")
        }));
        text.extend(
            stage
                .warnings
                .iter()
                .map(|warning| format!("{:width$}  warning: {warning}\n", "")),
        );
    }
    text
}

/// The state of a stage as it is printed.
pub(super) fn word(stage: &StageReport) -> String {
    serde_json::to_value(stage.status)
        .ok()
        .and_then(|value| value.as_str().map(|word| word.replace('_', " ")))
        .unwrap_or_default()
}

/// One stage with its inputs and tables.
pub fn stage(stage: &StageReport) -> String {
    let mut text = format!(
        "stage {} (uses {}, implementation {}): {}\n",
        stage.id,
        stage.uses,
        stage.implementation,
        word(stage)
    );
    text.push_str(
        &stage
            .reason
            .as_ref()
            .map_or_else(String::new, |reason| format!("because: {reason}\n")),
    );
    text.push_str(
        &stage
            .action
            .as_ref()
            .map_or_else(String::new, |action| format!("action {action}\n")),
    );
    for file in &stage.files {
        text.push_str(&format!(
            "file    {} = {}, {} bytes, {:.12}\n",
            file.place,
            file.path,
            file.bytes,
            file.blake3.as_str()
        ));
    }
    let mut table = |verb: &str, what: String, table: &TableRef| {
        text.push_str(&format!(
            "{verb:7} {what}, {}, {:.12}\n",
            counted(table.rows, "row"),
            table.table_hash.as_str()
        ));
    };
    stage.inputs.iter().for_each(|input| {
        table(
            "reads",
            format!("{} <- {}", input.port, input.from),
            &input.table,
        )
    });
    stage.outputs.iter().for_each(|output| {
        table(
            "writes",
            format!("{} ({})", output.port, output.table.schema),
            &output.table,
        )
    });
    if let Some(key) = &stage.key {
        let settings = serde_json::to_string_pretty(&key.settings).unwrap_or_default();
        text.push_str(&format!("seed    {}\nsettings {settings}\n", key.seed));
    }
    text.extend(stage.notes.iter().map(|note| format!("note    {note}\n")));
    text.extend(
        stage
            .warnings
            .iter()
            .map(|warning| format!("warning {warning}\n")),
    );
    text
}

/// The state of a run as it is printed.
pub fn status(manifest: &Manifest) -> &'static str {
    match manifest.status {
        RunStatus::Running => "running or killed",
        RunStatus::Done => "done",
        RunStatus::Failed => "failed",
    }
}

/// Why a stage ran, as text.
pub fn explanation(explanation: &Explanation) -> String {
    let stage = &explanation.stage;
    let mut text = format!("{} in run {}: {}", stage.id, explanation.run, word(stage));
    match (stage.status, &stage.reason) {
        (StageStatus::Cached, _) => {
            text.push_str(", all that it depends on was the same as in an earlier run\n")
        }
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
        let writer = explanation
            .writers
            .iter()
            .find(|(port, _)| change.what == "input" && *port == change.name);
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

/// Stages with their tables and files, as `calib check` prints them.
pub fn graph(plan: &Plan) -> String {
    let mut text = format!(
        "pipeline {}, seed {}, {}\n",
        plan.name,
        plan.seed,
        counted(plan.stages.len(), "stage")
    );
    for stage in &plan.stages {
        let uses = if stage.id == stage.entry.name {
            String::new()
        } else {
            format!(" (uses {})", stage.entry.name)
        };
        text.push_str(&format!("\n{}{uses}: {}\n", stage.id, stage.entry.summary));
        let width = stage
            .inputs
            .iter()
            .map(|input| input.port.name.len())
            .max()
            .unwrap_or(0);
        for input in &stage.inputs {
            let from = input.from.iter().map(|origin| {
                let writer = &plan.stages[origin.stage];
                format!("{}.{}", writer.id, writer.outputs[origin.port].name)
            });
            let from: Vec<String> = from.collect();
            let from = if from.is_empty() {
                "(none)".into()
            } else {
                from.join(", ")
            };
            text.push_str(&format!(
                "  reads   {:width$}  <- {from}\n",
                input.port.name
            ));
        }
        for file in &stage.files {
            text.push_str(&format!(
                "  file    {} = {}\n",
                file.place,
                file.path.display()
            ));
        }
        let outputs: Vec<String> = stage
            .outputs
            .iter()
            .map(|port| {
                if port.name == port.kind {
                    port.name.into()
                } else {
                    format!("{} ({})", port.name, port.kind)
                }
            })
            .collect();
        text.push_str(&format!("  writes  {}\n", outputs.join(", ")));
    }
    text
}
