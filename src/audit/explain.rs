//! Why a stage ran, or did not: its key in a run against its key in the run before.

use serde::Serialize;

use crate::error::{Error, Result, nearest};
use crate::pipeline::{KeyChange, Manifest, StageReport, changes_of};
use crate::store::Store;

/// Why a stage ran, or did not.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// Its id.
    pub run: String,
    /// What the manifest says of the stage.
    pub stage: StageReport,
    /// The run that the stage is compared with: the last one before of this pipeline that had it, of a complete run a
    /// complete one.
    pub before: Option<String>,
    /// What differs from the run before.
    pub changes: Vec<KeyChange>,
    /// For every input that changed: the stage that wrote it.
    pub writers: Vec<(String, String)>,
}

/// Explains a stage of a run.
pub fn explain(store: &Store, run: &str, stage: &str) -> Result<Explanation> {
    let manifest = Manifest::of(store, run)?;
    let Some(report) = manifest.stage(stage) else {
        let ids: Vec<&str> = manifest
            .stages
            .iter()
            .map(|stage| stage.id.as_str())
            .collect();
        let hint =
            nearest(stage, ids.iter().copied()).map(|near| format!("; did you mean `{near}`?"));
        let message = format!(
            "run {run} has no such stage{} Its stages: {}",
            hint.unwrap_or_else(|| ".".into()),
            ids.join(", ")
        );
        return Err(Error::spec(format!("stage {stage}"), message));
    };
    let mut explanation = Explanation {
        run: run.into(),
        stage: report.clone(),
        before: None,
        changes: Vec::new(),
        writers: Vec::new(),
    };
    let Some(key) = &report.key else {
        return Ok(explanation);
    };
    for id in store
        .runs()?
        .into_iter()
        .rev()
        .filter(|id| id.as_str() < run)
    {
        // A manifest that cannot be read explains nothing.
        let Ok(earlier) = Manifest::of(store, &id) else {
            continue;
        };
        let alike = !manifest.is_complete() || earlier.is_complete();
        if earlier.pipeline.name != manifest.pipeline.name || !alike {
            continue;
        }
        if let Some(before) = earlier.stage(stage).and_then(|stage| stage.key.as_ref()) {
            explanation.changes = changes_of(before, key);
            explanation.before = Some(id);
            break;
        }
    }
    let changed = |port: &str| {
        explanation
            .changes
            .iter()
            .any(|change| change.what == "input" && change.name == port)
    };
    let inputs = report.inputs.iter().filter(|input| changed(&input.port));
    explanation.writers = inputs
        .map(|input| (input.port.clone(), input.from.clone()))
        .collect();
    Ok(explanation)
}
