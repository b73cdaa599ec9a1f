//! What can be seen of a plan's input files without running it: the robot, the headers of the data. All faults at once.
//!
//! What a run would do, without doing it.

use super::plan::{InputFile, PlannedStage, Selection};
use super::run_state::{KeyState, RunState};
use super::{Override, Plan, reason, services, spec};
use crate::error::{Error, Fault, Result};
use crate::raw;
use crate::stage::{
    Context, InputTable, OpenedInput, Output, RawFile, STAGES, Services, Sink, StageEntry,
};
use crate::store::frame::Frame;
use crate::store::{Lookup, Store};
use serde::Serialize;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Looks at every stage's files. Gives what stages warn of; fails with the faults of all files, as faults of the author's where one
/// of them is (a robot file), else as faults of the data.
pub fn look(plan: &Plan) -> Result<Vec<String>> {
    let mut tables: Vec<Option<Vec<Frame>>> = Vec::new();
    let (mut spec, mut data, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    for stage in &plan.stages {
        let services = Onlooker {
            id: &stage.id,
            files: &stage.files,
            warnings: Mutex::default(),
        };
        let context = Context {
            id: &stage.id,
            seed: 0,
            jobs: 1,
            services: &services,
        };
        let seen = stage.stage.look(frames(plan, stage, &tables), &context);
        let warned = services
            .warnings
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        warnings.extend(
            warned
                .into_iter()
                .map(|line| format!("{}: {line}", stage.id)),
        );
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
        let Some(stage) = draft
            .stage
            .filter(|_| draft.entry.is_some_and(|entry| entry.name == "robot"))
        else {
            continue;
        };
        let services = Onlooker {
            id: &draft.id,
            files: &draft.files,
            warnings: Mutex::default(),
        };
        let seen = stage.look(
            Some(Vec::new()),
            &Context {
                id: &draft.id,
                seed: 0,
                jobs: 1,
                services: &services,
            },
        );
        if let Err(Error::Spec(more)) = seen {
            faults.extend(more);
        }
    }
    faults
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
            let input: InputTable = Box::new(frame.clone());
            Some((plan.stages.get(origin.stage)?.id.clone(), input))
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

/// Opens files, writes nothing and keeps what a stage warns of.
struct Onlooker<'a> {
    id: &'a str,
    files: &'a [InputFile],
    warnings: Mutex<Vec<String>>,
}

impl Services for Onlooker<'_> {
    fn open(&self, file: &RawFile) -> Result<OpenedInput> {
        services::open(self.id, self.files, file)
    }
    fn sink(&self, kind: &'static str) -> Result<Box<dyn Sink>> {
        Err(Error::Bug(format!(
            "stage {} writes a table of {kind} while it is only looked at",
            self.id
        )))
    }
    fn begin(&self, _what: &str, _total: Option<u64>, _unit: &str) {}
    fn advance(&self, _done: u64, _message: &str) {}
    fn note(&self, _line: String) {}
    fn warn(&self, line: String) {
        self.warnings
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(line);
    }
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
