//! Why a stage ran, or did not: its key in a run against its key in the run before.

use crate::error::{Error, Result, suggestion};
use crate::pipeline::{KeyChange, Manifest, StageReport, StageStatus, changes_of, find_run};
use crate::shell::typed;
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::Store;
use serde::Serialize;

/// Why a stage ran, or did not.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    /// Its id.
    pub(crate) run: String,
    /// What the manifest says of the stage.
    pub(crate) stage: StageReport,
    /// The run that the stage is compared with: the last one before of this pipeline that had it, of a complete run a
    /// complete one.
    pub(crate) before: Option<String>,
    /// What differs from the run before.
    pub(crate) changes: Vec<KeyChange>,
    /// For every input that changed: the stage that wrote it.
    pub(crate) writers: Vec<(String, String)>,
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
        let hint = suggestion(stage, ids.iter().copied());
        let message = format!(
            "run {run} has no such stage{hint} Its stages: {}",
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

/// Stages that diagnose positions.
pub const POSITIONS: [&str; 1] = [Diagnose::NAME];

/// A run by its name, and its stage that diagnoses, one of the kinds `uses`: `step` where it has several. Fails with what to type where
/// there is none.
pub fn diagnosis(
    store: &Store,
    run: &str,
    step: Option<&str>,
    uses: &[&str],
) -> Result<(Manifest, StageReport)> {
    let manifest = Manifest::of(store, &find_run(store, run)?)?;
    let place = format!("run {}", manifest.run_id);
    let diagnosed = manifest
        .stages
        .iter()
        .filter(|stage| uses.contains(&stage.uses.as_str()));
    let diagnosed: Vec<(&StageReport, &str)> =
        diagnosed.map(|stage| (stage, stage.id.as_str())).collect();
    let sets: String = manifest
        .overrides
        .iter()
        .map(|set| format!(" --set {}", typed(&format!("{}={}", set.target, set.value))))
        .collect();
    let again = format!("calib diagnose {}{sets}", typed(&manifest.pipeline.file));
    let Some((stage, id)) = the_stage(&place, &diagnosed, step)? else {
        let message = format!(
            "diagnosed nothing, its pipeline has no stage `diagnose`: put `- uses: diagnose` after the split of {}, then type\n  {again}",
            manifest.pipeline.file
        );
        return Err(Error::spec(place, message));
    };
    if !matches!(stage.status, StageStatus::Cached | StageStatus::Executed) {
        let step = if diagnosed.len() > 1 {
            format!(" --step {}", typed(id))
        } else {
            String::new()
        };
        return Err(Error::spec(
            place,
            format!("never came to its stage `{id}`; type\n  {again}{step}"),
        ));
    }
    let stage = stage.clone();
    Ok((manifest, stage))
}

/// The stage that is meant among several with their ids; nothing where there are none.
pub fn the_stage<'a, T: Copy>(
    place: &str,
    diagnosed: &[(T, &'a str)],
    step: Option<&str>,
) -> Result<Option<(T, &'a str)>> {
    let list = || {
        diagnosed
            .iter()
            .map(|(_, id)| *id)
            .collect::<Vec<_>>()
            .join(", ")
    };
    match (diagnosed, step) {
        ([], _) => Ok(None),
        (_, Some(step)) => diagnosed
            .iter()
            .find(|(_, id)| *id == step)
            .copied()
            .map(Some)
            .ok_or_else(|| {
                let hint = suggestion(step, diagnosed.iter().map(|(_, id)| *id));
                let message = format!("no stage `{step}` diagnoses{hint} Allowed: {}", list());
                Error::spec(place, message)
            }),
        ([only], None) => Ok(Some(*only)),
        _ => Err(Error::spec(
            place,
            format!("has several diagnoses; say which with --step: {}", list()),
        )),
    }
}
