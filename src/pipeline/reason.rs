//! Why a stage runs: the components of its key against those of its last run, in words.

use super::plan::Plan;
use crate::error::{Result, first_of};
use crate::store::{Lookup, StageKey, Store};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Names of changes that fit on a line.
const SHOWN: usize = 3;
/// Runs that are looked at before a stage counts as never run.
const HISTORY: usize = 200;

/// Why a stage runs whose action was looked up.
pub(super) fn why(
    store: &Store,
    plan: &Plan,
    key: &StageKey,
    found: &Lookup,
    forced: bool,
) -> Result<String> {
    match found {
        Lookup::Damaged(why) => Ok(why.clone()),
        _ if forced => Ok("forced".into()),
        _ => Ok(match last_key(store, &plan.name, &key.id)? {
            None => "never run".into(),
            Some(before) => changes(&before, key),
        }),
    }
}

/// The key that a stage of this pipeline had when it was last seen.
fn last_key(store: &Store, pipeline: &str, stage: &str) -> Result<Option<StageKey>> {
    // Among the thousands of runs of a fleet, most stages are new: their tables were never shown.
    if !store.shown(pipeline, stage) {
        return Ok(None);
    }
    for id in store.runs()?.iter().rev().take(HISTORY) {
        // A manifest that cannot be read explains nothing; it must not stop a run.
        let Ok(manifest) = store.manifest(id) else {
            continue;
        };
        if manifest["pipeline"]["name"] != pipeline {
            continue;
        }
        let stages = manifest["stages"]
            .as_array()
            .map(Vec::as_slice)
            .unwrap_or_default();
        let done = |entry: &&Value| {
            entry["id"] == stage && (entry["status"] == "executed" || entry["status"] == "cached")
        };
        let key = stages
            .iter()
            .find(done)
            .map(|entry| serde_json::from_value(entry["key"].clone()));
        if let Some(Ok(key)) = key {
            return Ok(Some(key));
        }
    }
    Ok(None)
}

/// A part of a key that is not what it was.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct KeyChange {
    /// `settings`, `input`, `file`, `schema of`, `seed`, `stage`, `implementation`, `key format`.
    pub(crate) what: &'static str,
    /// The setting, port or file.
    pub(crate) name: String,
    pub(crate) before: String,
    pub(crate) now: String,
}

/// Every part in which two keys of a stage differ.
pub fn changes_of(before: &StageKey, now: &StageKey) -> Vec<KeyChange> {
    let mut changes = Vec::new();
    let mut push = |what, name: &str, before: String, now: String| {
        if before != now {
            changes.push(KeyChange {
                what,
                name: name.into(),
                before,
                now,
            });
        }
    };
    push("stage", "", before.stage.clone(), now.stage.clone());
    push(
        "implementation",
        "",
        before.implementation.to_string(),
        now.implementation.to_string(),
    );
    let mut settings = BTreeSet::new();
    differing(&before.settings, &now.settings, &now.id, &mut settings);
    for (path, old, new) in settings {
        push("settings", &path, old, new);
    }
    let parts = |key: &StageKey| -> [BTreeMap<String, String>; 3] {
        let reads = key.reads.iter();
        let reads = reads.flat_map(|(port, all)| all.iter().map(|read| input(port, read)));
        let files = key.files.values();
        let files = files.map(|file| (file.name.clone(), file.content.to_string()));
        [reads.collect(), files.collect(), key.schemas.clone()]
    };
    let pairs = parts(before).into_iter().zip(parts(now));
    for (what, (old, new)) in ["input", "file", "schema of"].into_iter().zip(pairs) {
        let names: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
        for name in names {
            let of_map = |map: &BTreeMap<String, String>| {
                map.get(name).cloned().unwrap_or_else(|| "-".into())
            };
            push(what, name, of_map(&old), of_map(&new));
        }
    }
    push("seed", "", before.seed.to_string(), now.seed.to_string());
    push(
        "key format",
        "",
        before.key_format.to_string(),
        now.key_format.to_string(),
    );
    changes
}

/// A port, with the stage where it takes several tables, and the table.
fn input(port: &str, read: &crate::store::ReadKey) -> (String, String) {
    let name = read
        .stage
        .as_ref()
        .map_or_else(|| port.to_string(), |stage| format!("{port} ({stage})"));
    (name, read.table.to_string())
}

/// `settings changed: identify.ratios; input recording changed`.
fn changes(before: &StageKey, now: &StageKey) -> String {
    let changes = changes_of(before, now);
    let names = |what: &str| -> Vec<&str> {
        let named = changes.iter().filter(|change| change.what == what);
        let mut names: Vec<&str> = named
            .map(|change| change.name.split(" (").next().unwrap_or_default())
            .collect();
        names.dedup();
        names
    };
    let mut reasons = Vec::new();
    for what in ["stage", "implementation"] {
        let found = changes.iter().find(|change| change.what == what);
        reasons.extend(found.map(|change| format!("{what} {} -> {}", change.before, change.now)));
    }
    let settings = names("settings");
    if !settings.is_empty() {
        reasons.push(format!("settings changed: {}", first_of(&settings, SHOWN)));
    }
    for what in ["input", "file", "schema of"] {
        let names = names(what);
        if !names.is_empty() {
            reasons.push(format!("{what} {} changed", first_of(&names, SHOWN)));
        }
    }
    for (what, reason) in [
        ("seed", "seed changed"),
        ("key format", "calib keys its results in another way now"),
    ] {
        if changes.iter().any(|change| change.what == what) {
            reasons.push(reason.into());
        }
    }
    if reasons.is_empty() {
        "its tables are no longer in the store".into()
    } else {
        reasons.join("; ")
    }
}

/// Paths at which two values differ, with both values.
fn differing(
    before: &Value,
    now: &Value,
    path: &str,
    paths: &mut BTreeSet<(String, String, String)>,
) {
    match (before, now) {
        (Value::Object(old), Value::Object(new)) => {
            let names: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
            for name in names {
                let (old, new) = (
                    old.get(name).unwrap_or(&Value::Null),
                    new.get(name).unwrap_or(&Value::Null),
                );
                differing(old, new, &format!("{path}.{name}"), paths);
            }
        }
        _ if before == now => {}
        _ => {
            paths.insert((path.into(), before.to_string(), now.to_string()));
        }
    }
}
