//! The identified model that a verb works with: from a pipeline, a run in the store, or a table of parameters.

use super::means::Means;
use super::standing::{Candidate, stands};
use crate::compensate::{Arm, Coverage, Uncertainty};
use crate::effect::Load;
use crate::error::{Error, Fault, Result, nearest};
use crate::estimate::Model;
use crate::estimate::network::Correction;
use crate::pipeline::Selection;
use crate::robot::description::RobotDescription;
use crate::robot::import::{Text, read_calib, read_case};
use crate::robot::{Instrument, Measurements, RobotModel};
use crate::stage::{Diagnose, Stage};
use crate::store::frame::FrameBuilder;
use crate::store::{Store, TableRef};
use crate::table::{Network, Parameters, Prediction, Recording, Robot, Standing, Table};
use clap::Args;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde::Deserialize;
use std::ffi::OsString;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Where the model comes from.
#[derive(Args)]
pub(super) struct ModelArguments {
    /// A pipeline (its stages run as far as they are not done), a run as `calib log` names it (`latest`: the last that is done), or a
    /// table `parameters` (Parquet)
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// The stage whose parameters to take [default: the last `diagnose`, else the last that writes some; the one before it where
    /// held-out points are worse after it]
    #[arg(long, value_name = "STAGE")]
    step: Option<String>,
    /// The robot, where MODEL is a table: calib's YAML, a practice robot.json, or a table `robot` (Parquet)
    #[arg(long, value_name = "FILE")]
    robot: Option<PathBuf>,
    #[command(flatten)]
    means: Means,
    /// Prints no progress and no summary; warnings and errors remain
    #[arg(long, short)]
    pub quiet: bool,
}

/// What was identified, and from what.
pub(super) struct Identified {
    pub robot: RobotDescription,
    pub parameters: Parameters,
    pub model: Model,
    pub correction: Option<Correction>,
    /// The recording, where it is known.
    pub data: Option<Measurements>,
    /// Where the parameters come from, e.g. `run 01J..., stage geometry`.
    pub origin: String,
}

/// The part of a run's manifest that is needed here.
#[derive(Deserialize)]
struct Record {
    run_id: String,
    status: String,
    stages: Vec<StageRecord>,
}

#[derive(Deserialize)]
struct StageRecord {
    id: String,
    uses: String,
    inputs: Vec<TableRecord>,
    outputs: Vec<TableRecord>,
}

#[derive(Deserialize)]
struct TableRecord {
    #[serde(default)]
    kind: String,
    #[serde(flatten)]
    table: TableRef,
}

impl ModelArguments {
    pub fn jobs(&self) -> usize {
        self.means.jobs()
    }

    /// Loads the model; runs the pipeline's stages that are not done.
    pub fn load(&self, command_line: &[OsString]) -> Result<Identified> {
        let ending = self.model.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
        if ending == "parquet" {
            return self.of_table();
        }
        let store = self.means.store()?;
        let record = if matches!(ending.as_str(), "yaml" | "yml") {
            let plan = self.means.plan(&self.model)?;
            let stages = &plan.stages;
            let writes = |at: usize, kind: &str| stages[at].outputs.iter().any(|port| port.kind == kind);
            // Which one stands is known once all have predicted.
            let steps: Vec<usize> =
                (0..stages.len()).filter(|at| writes(*at, Parameters::KIND) || writes(*at, Network::KIND)).collect();
            if steps.is_empty() {
                let message = "identifies nothing; put a stage `identify` after the split";
                return Err(Error::spec(self.model.display().to_string(), message));
            }
            let plan = plan.needed_for_all(&steps);
            let outcome = self.means.run(&plan, &store, Selection::default(), self.quiet, command_line)?;
            serde_json::to_value(&outcome.manifest).map_err(|error| Error::Bug(error.to_string()))?
        } else {
            store.manifest(&self.run(&store)?)?
        };
        let record: Record =
            serde_json::from_value(record).map_err(|error| Error::store("manifest", format!("not of a run: {error}")))?;
        self.of_record(&record, &store)
    }

    /// The id of a run by its name, or of the last that is done by `latest`.
    fn run(&self, store: &Store) -> Result<String> {
        let name = self.model.to_string_lossy();
        let runs = store.runs()?;
        let done = |id: &&String| store.manifest(id).is_ok_and(|manifest| manifest["status"] == "done");
        if name == "latest" {
            let place = store.root().display().to_string();
            return runs.iter().rev().find(done).cloned().ok_or_else(|| Error::spec(place, "has no run that is done"));
        }
        store.find_run(&name).map_err(|error| match error {
            Error::Spec(faults) => {
                let why = faults.into_iter().next().map(|fault| fault.message).unwrap_or_default();
                Error::spec(&*name, format!("neither a pipeline (.yaml), a table (.parquet) nor a run: {why}"))
            }
            other => other,
        })
    }

    fn of_record(&self, record: &Record, store: &Store) -> Result<Identified> {
        if record.status != "done" {
            return Err(Error::spec(&record.run_id, format!("the run is {}, not done", record.status)));
        }
        let last = |kind: &str| record.stages.iter().flat_map(|stage| &stage.outputs).rfind(|output| output.kind == kind);
        let with =
            |stage: &StageRecord| stage.outputs.iter().find(|output| output.kind == Parameters::KIND).map(|o| o.table.clone());
        let found: Vec<(&StageRecord, TableRef)> = record.stages.iter().filter_map(|stage| Some((stage, with(stage)?))).collect();
        let stands = if self.step.is_none() { standing_of(record, store)? } else { None };
        let chosen = match &self.step {
            Some(step) => found.iter().find(|(stage, _)| stage.id == *step).ok_or_else(|| {
                let ids: Vec<&str> = found.iter().map(|(stage, _)| stage.id.as_str()).collect();
                let hint = nearest(step, ids.iter().copied()).map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
                Error::spec("--step", format!("no stage `{step}` writes parameters; {hint}allowed: {}", ids.join(", ")))
            })?,
            None => {
                let diagnosed = found.iter().rfind(|(stage, _)| stage.uses == Diagnose::NAME);
                let of_standing =
                    stands.as_ref().and_then(|stands| found.iter().find(|(stage, _)| stage.id == stands.model)).or(diagnosed);
                of_standing.or(found.last()).ok_or_else(|| Error::spec(&record.run_id, "the run identified nothing"))?
            }
        };
        let (stage, table) = chosen;
        let withdrawn: Vec<String> =
            stands.iter().flat_map(|stands| &stands.withdrawn).map(|gone| format!("warning: {gone}\n")).collect();
        let _ = std::io::stderr().write_all(withdrawn.concat().as_bytes());
        let robot = last(Robot::KIND).ok_or_else(|| Error::spec(&record.run_id, "the run has no table `robot`"))?;
        let robot = Robot::from_frame(&store.load(&robot.table)?)?.to_description()?;
        let parameters = Parameters::from_frame(&store.load(table)?)?;
        // A correction was learned on top of one model and belongs to no other.
        let learned = record.stages.iter().rfind(|stage| {
            let is_withdrawn = stands.as_ref().is_some_and(|stands| stands.withdrawn.iter().any(|gone| gone.step == stage.id));
            !is_withdrawn
                && stage.inputs.iter().any(|input| input.table.table_hash == table.table_hash)
                && stage.outputs.iter().any(|output| output.kind == Network::KIND)
        });
        let network = learned.and_then(|stage| stage.outputs.iter().find(|output| output.kind == Network::KIND));
        let recording = last(Recording::KIND).map(|output| Recording::from_frame(&store.load(&output.table)?)).transpose()?;
        let prismatic: Vec<bool> =
            (0..robot.joints.len()).map(|joint| !RobotModel::new(robot.clone()).is_revolute(joint)).collect();
        let correction = match network {
            Some(network) => Network::from_frame(&store.load(&network.table)?)?.correction(&prismatic)?,
            None => None,
        };
        let origin = format!("run {}, stage {}", record.run_id, stage.id);
        identified(robot, parameters, correction, recording.map(|table| table.measurements(&Instrument::default())), origin)
    }

    fn of_table(&self) -> Result<Identified> {
        let Some(robot) = &self.robot else {
            let message = "say which robot the parameters are of: --robot robot.yaml, or the table `robot` of the same run";
            return Err(Error::spec(self.model.display().to_string(), message));
        };
        let parameters: Parameters = read_table(&self.model)?;
        identified(read_robot(robot)?, parameters, None, None, format!("table {}", self.model.display()))
    }
}

/// The step that stands for a run.
fn standing_of(record: &Record, store: &Store) -> Result<Option<Standing>> {
    let candidate = |stage| {
        let StageRecord { id, uses, outputs, .. }: &StageRecord = stage;
        let of = |kind: &str| outputs.iter().find(|output| output.kind == kind).map(|output| &output.table);
        Some(Candidate { id, uses, parameters: of(Parameters::KIND), prediction: of(Prediction::KIND)? })
    };
    let candidates: Vec<Candidate> = record.stages.iter().filter_map(candidate).collect();
    stands(&candidates, store)
}

fn identified(
    robot: RobotDescription,
    parameters: Parameters,
    correction: Option<Correction>,
    data: Option<Measurements>,
    origin: String,
) -> Result<Identified> {
    if parameters.is_beside() {
        let message = "these parameters correct the simulation of sim_x, sim_y, sim_z, not the model of the robot file, which alone can be \
                       compensated and exported: take another stage's with --step, or diagnose the recording without these columns";
        return Err(Error::spec(origin, message));
    }
    let model = parameters.model(RobotModel::new(robot.clone()), &[], Load::GravityTorque)?;
    Ok(Identified { robot, parameters, model, correction, data, origin })
}

impl Identified {
    pub fn coverage(&self) -> Option<Coverage> {
        self.data.as_ref().filter(|data| data.rows() > 0).map(Coverage::of)
    }

    /// The uncertainty of what the model predicts; none where it was not identified from a recording that is at hand.
    pub fn uncertainty(&self, arm: &Arm) -> Option<Uncertainty> {
        let data = self.data.as_ref()?;
        let specs = self.model.stack.specs();
        let known = |name: &str| self.parameters.0.iter().any(|row| row.name == name && row.sigma.is_some());
        let free: Vec<usize> = (0..specs.len()).filter(|k| known(&specs[*k].name)).collect();
        let mut off: Vec<f64> =
            self.model.predict(data).iter().zip(&data.position).map(|(model, measured)| (model - measured).norm()).collect();
        off.sort_by(f64::total_cmp);
        // Of a point with one sigma per axis, half the errors are shorter: suspects do not count.
        const MEDIAN: f64 = 1.538;
        let sigma = off.get(off.len() / 2)? / MEDIAN;
        Uncertainty::new(arm, &free, data, sigma)
    }
}

/// Reads a robot by its ending: a table `robot`, the practice layout, or calib's YAML.
pub(super) fn read_robot(path: &Path) -> Result<RobotDescription> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    if ending == "parquet" {
        return read_table::<Robot>(path)?.to_description();
    }
    let label = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
    let file = Text { label: &label, text: &text };
    Ok(if ending == "json" { read_case(file)?.robot } else { read_calib(file, None)?.robot })
}

/// Reads a table from a Parquet file that calib wrote.
fn read_table<T: Table>(path: &Path) -> Result<T> {
    let label = path.display().to_string();
    let fault = |message: String| Error::Data(vec![Fault::new(&label, format!("not a table `{}` of calib: {message}", T::KIND))]);
    let file = File::open(path).map_err(|error| Error::spec(&label, format!("cannot be read: {error}")))?;
    let builder = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|error| fault(error.to_string()))?;
    let schema = builder.schema().clone();
    let reader = builder.build().map_err(|error| fault(error.to_string()))?;
    let batches = reader.collect::<std::result::Result<Vec<_>, _>>().map_err(|error| fault(error.to_string()))?;
    let batch = arrow::compute::concat_batches(&schema, &batches).map_err(|error| fault(error.to_string()))?;
    let mut frame = FrameBuilder::new(T::KIND);
    for (field, column) in schema.fields().iter().zip(batch.columns()) {
        frame.push(field.name(), column.clone());
    }
    let named = |error: Error| match error {
        Error::Bug(message) => fault(message),
        other => other,
    };
    T::from_frame(&frame.finish().map_err(named)?)
}
