//! What can be seen of a plan's input files without running it: the robot, the headers of the data. All faults at once.
//!
//! What a run would do, without doing it.

use super::plan::{InputFile, PlannedStage, Selection};
use super::run_state::{KeyState, RunState};
use super::services::StageServices;
use super::{Override, Plan, Unwatched, reason, spec};
use crate::error::{Error, Fault, Result};
use crate::raw;
use crate::stage::{Context, ErasedStage, InputTable, Output, STAGES, StageEntry};
use crate::store::frame::Frame;
use crate::store::{Lookup, Store};
use serde::Serialize;
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
    let Some(text) = raw::bytes(file)
        .ok()
        .and_then(|bytes| String::from_utf8(bytes).ok())
    else {
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
                    reason: reason::why(store, plan, &key, &found, selected.forces(index))?,
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
