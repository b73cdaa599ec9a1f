//! What was recorded of a robot, and what stages make of it: their inputs and outputs without a pipeline.

use crate::answer::{read, root};
use crate::desk::{Desk, diagnose_reads, identify_reads, table};
use calib::description::{JointDescription, JointKind, RobotDescription};
use calib::error::Result;
use calib::stage::ingest::{Ingest, IngestReads};
use calib::stage::split::{SplitBy, SplitReads};
use calib::stage::{
    Diagnose, Identify, Labelled, ReadRobot, RobotReads, Simulate, SimulateReads, Stage, Transfer,
    TransferReads,
};
use calib::store::frame::Frame;
use calib::table::{
    Findings, Parameters, Prediction, PredictionRow, Recording, Robot, Split, SplitRow, Table,
    VerdictRow,
};
use calib::twin::recorder::Shot;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a stage wrote and what it said.
pub struct Made {
    tables: BTreeMap<&'static str, Vec<Frame>>,
    pub notes: String,
    pub warnings: String,
}

impl Made {
    /// A table of a single chunk.
    pub fn get<T: Table>(&self) -> T {
        let mut chunks = table(&self.tables);
        assert_eq!(chunks.len(), 1, "chunks of {}", T::KIND);
        chunks.remove(0)
    }
    pub fn verdict(&self) -> VerdictRow {
        self.get::<calib::table::Verdict>().0.remove(0)
    }
    /// A quantity of the table of what can be observed.
    pub fn quantity(&self, name: &str) -> Option<f64> {
        let rows = self.get::<calib::table::Observability>().0;
        let found = rows.into_iter().find(|row| row.quantity == name);
        found.map(|row| row.value)
    }
    /// Effect and place of each finding.
    pub fn named(&self) -> Vec<(String, String)> {
        let findings: Findings = self.get();
        let name = |row: calib::table::FindingRow| (row.effect, row.place);
        findings.0.into_iter().map(name).collect()
    }
}

pub fn settings<T: DeserializeOwned>(with: Value) -> T {
    serde_json::from_value(with).unwrap()
}

pub fn tried<S: Stage>(stage: &S, reads: S::Reads) -> Result<Made> {
    let desk = Desk::default();
    let tables = desk.run(stage, reads)?;
    let [notes, warnings] =
        [desk.notes, desk.warnings].map(|lines| lines.into_inner().unwrap().join("\n"));
    Ok(Made {
        tables,
        notes,
        warnings,
    })
}

pub fn made<S: Stage>(stage: &S, reads: S::Reads) -> Made {
    tried(stage, reads).unwrap()
}

/// A robot, what was recorded of it, and which row is for what.
#[derive(Clone)]
pub struct Recorded {
    pub robot: Robot,
    pub recording: Recording,
    pub split: Split,
}

impl Recorded {
    /// Each row in the set of that name.
    pub fn dealt<'a>(robot: Robot, recording: Recording, set: impl Fn(usize) -> &'a str) -> Self {
        let row = |row: usize| SplitRow {
            sequence: recording.sequence[row],
            point_id: recording.point_id[row].clone(),
            set: set(row).into(),
        };
        let split = Split((0..recording.rows()).map(row).collect());
        Self {
            robot,
            recording,
            split,
        }
    }
    /// Every row is fitted.
    pub fn fitted(robot: &RobotDescription, recording: Recording) -> Self {
        Self::dealt(Robot::from_description(robot), recording, |_| "fit")
    }
    /// Each row is for what the recording says.
    pub fn by_usage(robot: Robot, recording: Recording) -> Self {
        let usage = recording.usage.clone();
        Self::dealt(robot, recording, |row| usage[row].as_deref().unwrap())
    }
    pub fn identify(&self, with: Value) -> Made {
        self.identify_by(&settings(with)).unwrap()
    }
    pub fn identify_by(&self, stage: &Identify) -> Result<Made> {
        let recorded = self.clone();
        tried(
            stage,
            identify_reads(recorded.robot, recorded.recording, recorded.split),
        )
    }
    pub fn diagnose(&self, with: Value) -> Made {
        self.diagnose_by(&settings(with)).unwrap()
    }
    pub fn diagnose_by(&self, stage: &Diagnose) -> Result<Made> {
        let recorded = self.clone();
        tried(
            stage,
            diagnose_reads(recorded.robot, recorded.recording, recorded.split),
        )
    }
    /// What becomes of a model that was identified elsewhere, on these sets; and of other recordings and models, by their stages.
    pub fn carry(
        &self,
        with: Value,
        parameters: &Parameters,
        recordings: &[(&str, &Recording)],
        models: &[(&str, Parameters, Prediction)],
    ) -> Made {
        let recorded = self.clone();
        let others = recordings.iter();
        let reads = TransferReads {
            robot: recorded.robot,
            recording: recorded.recording,
            split: recorded.split,
            parameters: parameters.clone(),
            covariance: None,
            recordings: others
                .map(|(stage, one)| labelled(stage, (*one).clone()))
                .collect(),
            models: models
                .iter()
                .map(|(stage, one, _)| labelled(stage, one.clone()))
                .collect(),
            predictions: models
                .iter()
                .map(|(stage, _, one)| labelled(stage, one.clone()))
                .collect(),
        };
        made(&settings::<Transfer>(with), reads)
    }
}

pub fn labelled<T>(stage: &str, table: T) -> Labelled<T> {
    Labelled {
        stage: stage.into(),
        table,
    }
}

/// What a twin records, without motor currents and what the tracker says of itself.
pub fn recording_of(robot: &RobotDescription, shots: &[Shot]) -> Recording {
    let sliding = |joint: &JointDescription| joint.kind == JointKind::Prismatic;
    let all = |value_of: fn(&Shot) -> &[f64]| shots.iter().flat_map(value_of).copied().collect();
    Recording {
        joints: robot.joints.len(),
        prismatic: robot.joints.iter().map(sliding).collect(),
        sequence: (0..shots.len() as i64).collect(),
        point_id: (0..shots.len()).map(|k| format!("P{k}")).collect(),
        usage: vec![None; shots.len()],
        q: all(|shot| &shot.q),
        position: shots.iter().map(|shot| shot.position).collect(),
        time: Some(shots.iter().map(|shot| shot.time_s).collect()),
        payload: Some(shots.iter().map(|shot| shot.payload_kg).collect()),
        temperature: Some(shots.iter().map(|shot| shot.temperature_c).collect()),
        direction: Some(all(|shot| &shot.direction)),
        ..Recording::default()
    }
}

/// Rows of a recording without what only some recordings have.
pub fn rows_of(whole: &Recording, rows: &[usize]) -> Recording {
    Recording {
        sequence: rows.iter().map(|row| whole.sequence[*row]).collect(),
        point_id: rows
            .iter()
            .map(|row| whole.point_id[*row].clone())
            .collect(),
        usage: vec![None; rows.len()],
        q: rows.iter().flat_map(|row| whole.q(*row).to_vec()).collect(),
        position: rows.iter().map(|row| whole.position[*row]).collect(),
        joints: whole.joints,
        prismatic: whole.prismatic.clone(),
        ..Recording::default()
    }
}

/// Mean error of some rows, mm.
pub fn mean_mm(prediction: &Prediction, is: impl Fn(&PredictionRow) -> bool) -> f64 {
    let errors = || {
        prediction
            .0
            .iter()
            .filter(|row| is(row))
            .map(|row| row.error_mm)
    };
    errors().sum::<f64>() / errors().count() as f64
}

pub fn mean_mm_of(prediction: &Prediction, set: &str) -> f64 {
    mean_mm(prediction, |row| row.set == set)
}

/// A shipped pipeline with its variables put in.
pub struct Example {
    folder: PathBuf,
    stages: Value,
}

impl Example {
    pub fn new(name: &str, variables: &[(&str, &str)]) -> Self {
        let folder = root("pipelines").join(name);
        let mut text = read(folder.join("pipeline.yaml"));
        for (key, value) in variables {
            text = text.replace(&format!("${{{key}}}"), value);
        }
        let mut whole: Value = serde_saphyr::from_str(&text).unwrap();
        let stages = whole["stages"].take();
        Self { folder, stages }
    }
    /// Settings of a stage, by its name or by what it uses.
    pub fn with<T: DeserializeOwned>(&self, id: &str) -> T {
        let is =
            |stage: &&Value| stage["id"] == id || (stage["id"].is_null() && stage["uses"] == id);
        let stage = self.stages.as_array().unwrap().iter().find(is).unwrap();
        settings(match &stage["with"] {
            Value::Null => json!({}),
            with => with.clone(),
        })
    }
    pub fn robot(&self) -> Robot {
        let mut stage: ReadRobot = self.with("robot");
        stage.file.0 = self.folder.join(&stage.file.0);
        made(&stage, RobotReads {}).get()
    }
    /// What is ingested, dealt as the pipeline says.
    pub fn ingested(&self) -> Recorded {
        self.ingested_by(&self.with("ingest"), &self.with("split"))
    }
    pub fn ingested_by(&self, ingest: &Ingest, split: &SplitBy) -> Recorded {
        let robot = self.robot();
        let reads = IngestReads {
            robot: robot.clone(),
        };
        let recording: Recording = made(ingest, reads).get();
        let reads = SplitReads {
            recording: recording.clone(),
        };
        let split = made(split, reads).get();
        Recorded {
            robot,
            recording,
            split,
        }
    }
    /// What its twin records, with other settings of the twin; and what is true of that.
    pub fn simulated(&self, change: Value) -> (Recorded, calib::table::Truth) {
        let mut with: Value = self.with("simulate");
        let with_these = with.as_object_mut().unwrap();
        with_these.extend(change.as_object().cloned().unwrap());
        let robot = self.robot();
        let reads = SimulateReads {
            robot: robot.clone(),
        };
        let made = made(&settings::<Simulate>(with), reads);
        (Recorded::by_usage(robot, made.get()), made.get())
    }
}
