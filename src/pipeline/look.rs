//! What can be seen of a plan's input files without running it: the robot, the headers of the data. All faults at once.

use super::plan::{InputFile, PlannedStage, Selection};
use super::run_state::{KeyState, RunState};
use super::services::StageServices;
use super::{Override, Plan, Unwatched, spec};
use crate::error::{Error, Fault, Result, first_of};
use crate::raw;
use crate::stage::{Context, ErasedStage, InputTable, Output, STAGES, StageEntry};
use crate::store::frame::Frame;
use crate::store::{Lookup, StageKey, Store};
use serde::Serialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Looks at every stage's files. Gives what stages warn of; fails with the faults of all files, as faults of the author's where one
/// of them is (a robot file), else as faults of the data.
pub fn look(plan: &Plan) -> Result<Vec<String>> {
    let mut tables: Vec<Option<Vec<Frame>>> = Vec::new();
    let (mut spec, mut data, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for stage in &plan.stages {
        let inputs = frames(plan, stage, &tables);
        let (seen, warned) = look_at(&*stage.stage, &stage.id, &stage.files, inputs);
        warnings.extend(warned.iter().map(|line| format!("{}: {line}", stage.id)));
        tables.push(match seen {
            Ok(outputs) => outputs.and_then(in_memory),
            Err(Error::Spec(faults)) => {
                spec.extend(faults);
                None
            }
            Err(Error::Data(faults)) => {
                data.extend(faults);
                None
            }
            Err(other) => return Err(other),
        });
    }
    let authors = !spec.is_empty();
    let mut faults: Vec<Fault> = Vec::new();
    for fault in spec.into_iter().chain(data) {
        // A file that two stages read has its faults once.
        if !faults.contains(&fault) {
            faults.push(fault);
        }
    }
    match (faults.is_empty(), authors) {
        (true, _) => Ok(warnings),
        (_, true) => Err(Error::Spec(faults)),
        _ => Err(Error::Data(faults)),
    }
}

/// Reads a pipeline. Fails with every fault of its YAML and of the robot file at once.
pub fn checked_plan(file: &Path, overrides: &[Override]) -> Result<Plan> {
    Plan::load(file, overrides, STAGES).map_err(|error| match error {
        Error::Spec(mut faults) => {
            let robots = faults_of_robots(file, overrides, STAGES);
            let new: Vec<Fault> = robots
                .into_iter()
                .filter(|fault| !faults.contains(fault))
                .collect();
            faults.extend(new);
            Error::Spec(faults)
        }
        other => other,
    })
}

/// The faults of the robot files of a pipeline whose YAML has faults of its own: where the stage that names one can be read, all are told
/// in one pass.
fn faults_of_robots(
    file: &Path,
    overrides: &[Override],
    registry: &'static [StageEntry],
) -> Vec<Fault> {
    let mut faults = Vec::new();
    let Ok(text) = raw::text(file) else {
        return faults;
    };
    for draft in spec::read(file, &text, overrides, registry).stages {
        let is_robot = draft.entry.is_some_and(|entry| entry.name == "robot");
        if let Some(stage) = draft.stage.filter(|_| is_robot)
            && let (Err(Error::Spec(more)), _) =
                look_at(&*stage, &draft.id, &draft.files, Some(Vec::new()))
        {
            faults.extend(more);
        }
    }
    faults
}

/// What a stage sees of its files and tables, and what it warns of.
fn look_at(
    stage: &dyn ErasedStage,
    id: &str,
    files: &[InputFile],
    inputs: Option<Vec<Vec<(String, InputTable)>>>,
) -> (Result<Option<Vec<Output>>>, Vec<String>) {
    let services = StageServices::new(id, None, files, &Unwatched);
    let context = Context {
        id,
        seed: 0,
        jobs: 1,
        services: &services,
    };
    let seen = stage.look(inputs, &context);
    (seen, services.lines().warnings)
}

/// The tables that a stage reads, if those before it could give them all.
fn frames(
    plan: &Plan,
    stage: &PlannedStage,
    tables: &[Option<Vec<Frame>>],
) -> Option<Vec<Vec<(String, InputTable)>>> {
    let inputs = stage.inputs.iter().map(|input| {
        let frames = input.from.iter().map(|origin| {
            let frame = tables.get(origin.stage)?.as_ref()?.get(origin.port)?;
            let id = plan.stages.get(origin.stage)?.id.clone();
            Some((id, InputTable::Frame(frame.clone())))
        });
        frames.collect()
    });
    inputs.collect()
}

fn in_memory(outputs: Vec<Output>) -> Option<Vec<Frame>> {
    let frames = outputs.into_iter().map(|output| match output {
        Output::Frame(frame) => Some(frame),
        Output::Streamed(_) => None,
    });
    frames.collect()
}

/// What would become of a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "status")]
pub enum Prospect {
    /// Its tables are there.
    Cached,
    /// It would run.
    Run {
        /// Why.
        reason: String,
    },
    /// Not known before another stage has run.
    Pending {
        /// Ids of stages.
        on: String,
    },
    /// Outside of `--only`, `--from`, `--until`, and not cached.
    NotSelected,
}

/// What a run would do with a stage.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Forecast {
    pub(crate) id: String,
    pub(crate) uses: String,
    /// Whether it would run.
    #[serde(flatten)]
    pub(crate) prospect: Prospect,
}

/// What a run would do, stage by stage. Fails where files cannot be read.
pub fn preview(plan: &Plan, store: &Store, selection: &Selection) -> Result<Vec<Forecast>> {
    let selected = selection.of(plan)?;
    let mut state = RunState::new(plan);
    let mut forecasts = Vec::new();
    for (index, stage) in plan.stages.iter().enumerate() {
        let inside = selected.stages.contains(&index);
        let prospect = match state.key(index)? {
            KeyState::Pending(on) if inside => Prospect::Pending {
                on: plan.stages[on].id.clone(),
            },
            KeyState::Pending(_) => Prospect::NotSelected,
            KeyState::Known(key) => match store.action(&key)? {
                Lookup::Done(record) if !selected.forces(index) => {
                    state.tables[index] = Some(record.tables);
                    Prospect::Cached
                }
                _ if !inside => Prospect::NotSelected,
                found => Prospect::Run {
                    reason: why(store, plan, &key, &found, selected.forces(index))?,
                },
            },
        };
        forecasts.push(Forecast {
            id: stage.id.clone(),
            uses: stage.entry.name.into(),
            prospect,
        });
    }
    Ok(forecasts)
}

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
