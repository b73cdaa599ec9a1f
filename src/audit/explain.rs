//! Why a stage ran, or did not: its key in a run against its key in the run before.

use crate::error::{Error, Result, suggestion};
use crate::pipeline::{KeyChange, Manifest, StageReport, StageStatus, changes_of, find_run};
use crate::shell::typed;
use crate::stage::{DeclaredStage, Diagnose};
use crate::store::{ActionRecord, Store, TableHash};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Why a stage ran, or did not.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
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

/// A table with the action that made it.
#[derive(Debug, Clone, Serialize)]
pub struct LineageNode {
    pub(crate) table_hash: TableHash,
    /// Nothing where the store has no record of who made it.
    pub(crate) made: Option<Provenance>,
}

/// What made a table.
#[derive(Debug, Clone, Serialize)]
pub struct Provenance {
    pub(crate) stage: String,
    pub(crate) uses: String,
    pub(crate) implementation: u32,
    /// On which it was written.
    pub(crate) port: String,
    /// `name/version`.
    pub(crate) schema: String,
    pub(crate) rows: u64,
    /// Id of the action record.
    pub(crate) action: String,
    /// Id of the run that executed it.
    pub(crate) run: String,
    /// RFC 3339, UTC.
    pub(crate) when: String,
    pub(crate) settings: serde_json::Value,
    pub(crate) seed: u64,
    /// Raw files: name and blake3.
    pub(crate) files: Vec<(String, String)>,
    /// Input tables by port; empty where they were shown already.
    pub(crate) reads: Vec<(String, LineageNode)>,
    /// Whether its inputs stand above in the same answer.
    pub(crate) shown_before: bool,
}

/// Traces the table whose content hash begins with `start`.
pub fn lineage(store: &Store, start: &str) -> Result<LineageNode> {
    let mut makers: BTreeMap<TableHash, (ActionRecord, String)> = BTreeMap::new();
    for record in store.records()? {
        for (port, table) in &record.tables {
            // A table that several actions gave is traced to the first of them in the order of their ids.
            makers
                .entry(table.table_hash.clone())
                .or_insert_with(|| (record.clone(), port.clone()));
        }
    }
    let wanted = start.to_lowercase();
    let found: Vec<&TableHash> = makers
        .keys()
        .filter(|hash| hash.as_str().starts_with(&wanted))
        .collect();
    match found.as_slice() {
        [hash] => Ok(trace(hash, &makers, &mut BTreeSet::new())),
        [] => Err(Error::spec(
            format!("table {start}"),
            "no action in the store made it: is it another store's? (--store DIR)",
        )),
        several => Err(Error::spec(
            format!("table {start}"),
            format!(
                "the hashes of {} tables begin like this; give more of the hash",
                several.len()
            ),
        )),
    }
}

fn trace(
    hash: &TableHash,
    makers: &BTreeMap<TableHash, (ActionRecord, String)>,
    shown: &mut BTreeSet<String>,
) -> LineageNode {
    let made = makers.get(hash).map(|(record, port)| {
        let shown_before = !shown.insert(record.id.to_string());
        let table = record.tables.get(port);
        let reads = record
            .key
            .reads
            .iter()
            .flat_map(|(port, tables)| tables.iter().map(move |table| (port, table)));
        let reads = if shown_before {
            Vec::new()
        } else {
            reads
                .map(|(port, read)| (port.clone(), trace(&read.table, makers, shown)))
                .collect()
        };
        Provenance {
            stage: record.key.id.clone(),
            uses: record.key.stage.clone(),
            implementation: record.key.implementation,
            port: port.clone(),
            schema: table.map(|table| table.schema.clone()).unwrap_or_default(),
            rows: table.map_or(0, |table| table.rows),
            action: record.id.to_string(),
            run: record.account.run.clone(),
            when: record.account.started.clone(),
            settings: record.key.settings.clone(),
            seed: record.key.seed,
            files: record
                .key
                .files
                .values()
                .map(|file| (file.name.clone(), file.content.to_string()))
                .collect(),
            reads,
            shown_before,
        }
    });
    LineageNode {
        table_hash: hash.clone(),
        made,
    }
}

/// Runs of one pipeline that were met so far, from the last one back.
#[derive(Default)]
struct Met {
    complete: usize,
    others: usize,
}

/// Ids of all actions that tagged runs and the `last` complete runs of every pipeline used, and as many other runs since. A manifest that
/// cannot be read stops a sweep: nobody knows what it keeps.
pub fn kept_actions(store: &Store, last: usize) -> Result<BTreeSet<String>> {
    let mut tagged: BTreeSet<String> = store.tags()?.into_values().collect();
    tagged.extend(store.runs_of_fleets()?);
    let mut seen: BTreeMap<String, Met> = BTreeMap::new();
    let mut keep = BTreeSet::new();
    for run in store.runs()?.into_iter().rev() {
        let manifest = Manifest::of(store, &run)?;
        let met = seen.entry(manifest.pipeline.name.clone()).or_default();
        // Failed and partial runs and those of other verbs keep their stages, but take no complete run's place.
        let place = if manifest.is_complete() {
            &mut met.complete
        } else {
            &mut met.others
        };
        *place += 1;
        let recent = *place <= last && (manifest.is_complete() || met.complete < last);
        if recent || tagged.contains(&run) {
            keep.extend(
                manifest
                    .stages
                    .iter()
                    .filter_map(|stage| Some(stage.action.as_ref()?.to_string())),
            );
        }
    }
    Ok(keep)
}
