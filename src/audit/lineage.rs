//! Where a table comes from: the action that made it, its input tables, theirs, down to raw files.

use crate::error::{Error, Result};
use crate::pipeline::Manifest;
use crate::store::{ActionRecord, Store, TableHash};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// A table with the action that made it.
#[derive(Debug, Clone, Serialize)]
pub struct LineageNode {
    /// Hash of its content.
    pub(crate) table_hash: TableHash,
    /// Nothing where the store has no record of who made it.
    pub(crate) made: Option<Provenance>,
}

/// What made a table.
#[derive(Debug, Clone, Serialize)]
pub struct Provenance {
    /// Id of the stage.
    pub(crate) stage: String,
    /// Its kind.
    pub(crate) uses: String,
    /// Version of its algorithm.
    pub(crate) implementation: u32,
    /// On which it was written.
    pub(crate) port: String,
    /// `name/version`.
    pub(crate) schema: String,
    /// How many.
    pub(crate) rows: u64,
    /// Id of the action record.
    pub(crate) action: String,
    /// Id of the run that executed it.
    pub(crate) run: String,
    /// RFC 3339, UTC.
    pub(crate) when: String,
    /// With defaults filled in.
    pub(crate) settings: serde_json::Value,
    /// The seed of the stage.
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
