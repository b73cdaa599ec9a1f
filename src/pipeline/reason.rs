//! Why a stage runs: the components of its key against those of its last run, in words.

use super::plan::Plan;
use crate::error::Result;
use crate::store::{FileHash, Lookup, StageKey, Store};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Runs that are looked at before a stage counts as never run.
const HISTORY: usize = 200;

/// Why a stage runs whose action was looked up.
pub(super) fn why(store: &Store, plan: &Plan, key: &StageKey, found: &Lookup, forced: bool) -> Result<String> {
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
        let Ok(manifest) = store.manifest(id) else { continue };
        if manifest["pipeline"]["name"] != pipeline {
            continue;
        }
        let stages = manifest["stages"].as_array().map(Vec::as_slice).unwrap_or_default();
        let done = |entry: &&Value| entry["id"] == stage && (entry["status"] == "executed" || entry["status"] == "cached");
        let key = stages.iter().find(done).map(|entry| serde_json::from_value(entry["key"].clone()));
        if let Some(Ok(key)) = key {
            return Ok(Some(key));
        }
    }
    Ok(None)
}

/// `settings changed: identify.ratios; input recording changed`.
fn changes(before: &StageKey, now: &StageKey) -> String {
    let mut reasons = Vec::new();
    if before.stage != now.stage {
        reasons.push(format!("stage {} -> {}", before.stage, now.stage));
    }
    if before.implementation != now.implementation {
        reasons.push(format!("implementation {} -> {}", before.implementation, now.implementation));
    }
    let mut settings = BTreeSet::new();
    differing(&before.settings, &now.settings, &now.id, &mut settings);
    if !settings.is_empty() {
        reasons.push(format!("settings changed: {}", few(settings.into_iter().collect())));
    }
    reasons.extend(compare("input", &before.reads, &now.reads));
    reasons.extend(compare("file", &by_name(before), &by_name(now)));
    reasons.extend(compare("schema of", &before.schemas, &now.schemas));
    if before.seed != now.seed {
        reasons.push("seed changed".into());
    }
    if before.key_format != now.key_format {
        reasons.push("calib keys its results in another way now".into());
    }
    if reasons.is_empty() { "its tables are no longer in the store".into() } else { reasons.join("; ") }
}

fn by_name(key: &StageKey) -> BTreeMap<String, (&str, &FileHash)> {
    key.files.iter().map(|(place, file)| (file.name.clone(), (place.as_str(), &file.content))).collect()
}

fn compare<T: PartialEq>(what: &str, before: &BTreeMap<String, T>, now: &BTreeMap<String, T>) -> Option<String> {
    let names: BTreeSet<&String> = before.keys().chain(now.keys()).collect();
    let changed: Vec<String> =
        names.into_iter().filter(|name| before.get(*name) != now.get(*name)).map(|name| name.to_string()).collect();
    (!changed.is_empty()).then(|| format!("{what} {} changed", few(changed)))
}

/// Paths at which two values differ.
fn differing(before: &Value, now: &Value, path: &str, paths: &mut BTreeSet<String>) {
    match (before, now) {
        (Value::Object(old), Value::Object(new)) => {
            let names: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
            for name in names {
                let (old, new) = (old.get(name).unwrap_or(&Value::Null), new.get(name).unwrap_or(&Value::Null));
                differing(old, new, &format!("{path}.{name}"), paths);
            }
        }
        _ if before == now => {}
        _ => {
            paths.insert(path.into());
        }
    }
}

fn few(names: Vec<String>) -> String {
    const SHOWN: usize = 3; // more do not fit on a line
    match names.len() {
        0..=SHOWN => names.join(", "),
        all => format!("{} and {} more", names[..SHOWN].join(", "), all - SHOWN),
    }
}
