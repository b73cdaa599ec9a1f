//! A pipeline that was run: its tables, its models, its diagnosis.

use super::{Model, Poses, Robot};
use crate::audit::{QueryTables, diagnosis};
use crate::error::{Error, Fault, Result};
use crate::identified::IdentifiedModel;
use crate::pipeline::{
    self, Manifest, Observer, Override, Purpose, RunOptions, Selection, Surroundings, checked_plan,
    find_run,
};
use crate::poses::{PoseRequest, proposal};
use crate::report::{Page, PageLanguage};
use crate::stage::DIAGNOSES;
use crate::store::Store;
use crate::store::frame::Frame;
use crate::summary::{DiagnosisSummary, LimitsSummary, diagnosis_page};
use serde_json::Value;
use std::path::Path;

/// What is to be run, and how.
pub struct RunRequest<'a> {
    /// The YAML file.
    pub pipeline: &'a Path,
    /// `TARGET=VALUE`, as `--set` of the command line.
    pub overrides: &'a [String],
    /// Worker threads; no result depends on it.
    pub jobs: usize,
    /// Who runs it, where and when.
    pub surroundings: &'a Surroundings,
    /// Who watches.
    pub observer: &'a dyn Observer,
}

/// Runs a pipeline as `calib run` does: what is done already is not done again.
pub fn run(request: &RunRequest, store: Store) -> Result<CalibRun> {
    let overrides = request.overrides.iter().map(|text| {
        Override::parse(text).map_err(|message| Error::spec("set", message.to_string()))
    });
    let overrides = overrides.collect::<Result<Vec<Override>>>()?;
    let plan = checked_plan(request.pipeline, &overrides)?;
    let options = RunOptions {
        selection: Selection::default(),
        jobs: request.jobs,
        purpose: Purpose::Run,
    };
    let done = pipeline::run(
        &plan,
        &store,
        &options,
        request.surroundings,
        request.observer,
    )?;
    Ok(CalibRun {
        manifest: done.manifest,
        store,
    })
}

/// A run in a store.
pub struct CalibRun {
    /// What was done.
    pub manifest: Manifest,
    store: Store,
}

impl CalibRun {
    /// A run as `calib log` names it: HEAD, HEAD~1, a tag, or an id.
    pub fn open(store: Store, name: &str) -> Result<Self> {
        let manifest = Manifest::of(&store, &find_run(&store, name)?)?;
        Ok(Self { manifest, store })
    }

    /// Names of its tables, `stage.port`, in the order of the pipeline.
    pub fn tables(&self) -> Vec<String> {
        let tables = QueryTables::of(&self.manifest);
        let named = tables
            .iter()
            .map(|table| format!("{}.{}", table.stage, table.port));
        named.collect()
    }

    /// A table: `stage.port`, `stage/port`, or the kind where one stage alone writes it. Fails where it has left the store.
    pub fn table(&self, name: &str) -> Result<Frame> {
        let tables = QueryTables::of(&self.manifest);
        let found = tables.find(name).map_err(|error| match error {
            Error::Spec(faults) => {
                let messages = faults.into_iter();
                Error::Spec(
                    messages
                        .map(|fault| Fault::new(name, fault.message))
                        .collect(),
                )
            }
            other => other,
        })?;
        self.store.load(&found.table)
    }

    /// The model of a step, else of the step that stands for the run, with its refusals.
    pub fn model(&self, step: Option<&str>) -> Result<Model> {
        let mut model = IdentifiedModel::of_run(&self.store, &self.manifest, step)?;
        let exceeded = LimitsSummary::of(&self.manifest, &self.store)?.exceeded();
        model.refusals.extend(exceeded);
        Ok(Model::new(model))
    }

    /// The stage that diagnosed, `step` where there are several, and what it said.
    pub fn diagnosis(&self, step: Option<&str>) -> Result<(String, DiagnosisSummary)> {
        let run = &self.manifest.run_id;
        let (_, stage) = diagnosis(&self.store, run, step, &DIAGNOSES)?;
        let summary = DiagnosisSummary::read(run, &stage, &self.store)?;
        Ok((stage.id.clone(), summary))
    }

    /// The page of a diagnosis, `step` where there are several.
    pub fn diagnosis_page(&self, step: Option<&str>, language: PageLanguage) -> Result<Page> {
        let run = &self.manifest.run_id;
        let (_, stage) = diagnosis(&self.store, run, step, &DIAGNOSES)?;
        let summary = DiagnosisSummary::read(run, &stage, &self.store)?;
        diagnosis_page(&summary, &stage, (&self.store, ""), language)
    }
}

/// Poses to measure, and what they promise.
#[derive(Debug, Clone, PartialEq)]
pub struct ProposedPoses {
    /// In the order of driving; columns are `payload_kg` and, of each joint, `dir`: whether its last move goes upwards.
    pub poses: Poses,
    /// As `calib poses` prints it.
    pub text: String,
    /// As `calib poses --json` prints it.
    pub document: Value,
}

/// Poses for all parameters together, or to separate two effects. Fails with what is wrong with the request, and where the arm cannot go
/// where it may.
pub fn propose_poses(
    robot: &Robot,
    request: &PoseRequest,
    pair: &[String],
) -> Result<ProposedPoses> {
    let faults = request.faults(pair);
    if !faults.is_empty() {
        // Settings have the names of the options.
        let named = faults.into_iter().map(|fault| Fault {
            place: fault.place.trim_start_matches('-').into(),
            ..fault
        });
        return Err(Error::Spec(named.collect()));
    }
    let description = robot.description.clone();
    let answer = proposal(request, description, &robot.description.name, pair, None)?;
    let poses = answer.drive.map(|drive| Poses {
        joints_rad: robot.from_si(&drive.poses.q),
        columns: [
            ("payload_kg".to_string(), drive.poses.payload),
            ("dir".to_string(), drive.direction),
        ]
        .into(),
    });
    Ok(ProposedPoses {
        poses: poses.unwrap_or_default(),
        text: answer.text,
        document: answer.document,
    })
}
