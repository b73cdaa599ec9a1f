//! Stages: pure functions from tables to tables. One file each, one line each in [`STAGES`].
//!
//! Stages without their types, so that a pipeline can hold any of them.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::{description, error, statistics, units};
use calib_numerics::{compensate, effect, estimate, observation, spatial, yaml};
use {calib_drives as drives, calib_dynamics as dynamics, calib_engine as engine};
use {calib_program as program, calib_raw as raw, calib_table as table, calib_twin as twin};

use crate::error::{Error, Fault, Place, Result};
use crate::raw::InputSource;
use crate::yaml::{Node, Trouble, typed};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

mod cell_evidence;
mod compare;
mod compare_torques;
mod contact;
mod curves;
mod declared_effects;
mod diagnose;
mod diagnose_drives;
mod diagnose_torques;
mod doubtful;
mod dynamic_arm;
mod identified;
mod identify;
pub mod ingest;
mod known_cell;
pub mod learn;
mod masses;
mod optimise;
mod remarks;
mod report;
mod robot;
mod settings;
mod simulate;
pub mod split;
mod transfer;
mod validate;

pub use calib_report::{
    Accepted, Report, ReportDrivesReads, ReportPages, ReportReads, ReportTorquesReads,
};
pub use cell_evidence::{
    CellEvidence, CellEvidenceWrites, Given, STEPS, TorqueEvidence, amplitude_step,
};
pub use compare::{Compare, CompareReads};
pub use compare_torques::{CompareTorques, CompareTorquesReads};
use diagnose::AskedRows;
pub use diagnose::{CellPrior, Diagnose, DiagnoseReads};
pub use diagnose_drives::short;
pub use diagnose_drives::{DiagnoseDrives, DiagnoseDrivesReads, DiagnoseDrivesWrites};
pub use diagnose_torques::{
    ConsistencySetting, DiagnoseTorques, DiagnoseTorquesReads, DiagnoseTorquesWrites, HoldOut,
    InertialSetting,
};
pub use dynamic_arm::{dynamic_arm, must_be_bodies, must_turn, torque_per_ampere};
pub use identify::{Identify, IdentifyReads};
pub use identify::{Stiffness, StiffnessReads};
pub use learn::{Learn, LearnReads, LearnWrites};
pub use masses::{Masses, MassesReads, MassesWrites};
pub use optimise::{BenchmarkProblem, Optimise, OptimiseReads};
pub use report::{ReportDrives, ReportDrivesWrites, ReportTorques, ReportTorquesWrites};
pub use robot::{ReadRobot, RobotFormat, RobotReads, RobotWrites};
pub use settings::FoldSetting;
pub use settings::matches;
pub use simulate::{Remainder, Simulate, SimulateReads, SimulateWrites};
pub use transfer::{Transfer, TransferReads};
pub use validate::{Validate, ValidateReads};

pub use crate::table::ports::{
    Arity, Chunks, InputTable, Labelled, Output, Port, PortValue, Produced, Reads, Sink, Streamed,
    StreamedTable, Writes,
};

/// An input file named in the settings. Its content, not its path, is part of the stage's key.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct RawFile(pub PathBuf);

impl Serialize for RawFile {
    /// A path is no part of the key: two names of one content are one input.
    fn serialize<S: serde::Serializer>(
        &self,
        serializer: S,
    ) -> std::result::Result<S::Ok, S::Error> {
        serializer.serialize_str("<file>")
    }
}

/// An opened input file.
pub struct OpenedInput {
    /// As the user named it, for messages and tables.
    pub label: String,
    /// Its bytes.
    pub reader: Box<dyn InputSource>,
    /// Bytes, where known.
    pub size: Option<u64>,
}

/// What a stage may ask of the engine while it runs.
pub trait Services: Sync {
    /// Opens an input file of the settings. Fails where it cannot be read.
    fn open(&self, file: &RawFile) -> Result<OpenedInput>;
    /// A table to be written chunk by chunk.
    fn sink(&self, kind: &'static str) -> Result<Box<dyn Sink>>;
    /// A bar starts: what is done, how many units in all, and what a unit is called (`rows`, `generations`).
    fn begin(&self, what: &str, total: Option<u64>, unit: &str);
    /// So many units of the bar are done.
    fn advance(&self, done: u64, message: &str);
    /// A line for the person and the run's record, e.g. `rank 27 as expected; 8 parameters redundant`.
    fn note(&self, line: String);
    /// A line that a person must not overlook.
    fn warn(&self, line: String);
}

/// The stage's place in the run.
pub struct Context<'a> {
    /// The id of this stage in the pipeline; the `step` of its tables.
    pub id: &'a str,
    /// Derived from the pipeline's seed and the stage id.
    pub seed: u64,
    /// Worker threads that the stage may use; results must not depend on it.
    pub jobs: usize,
    /// What the engine offers.
    pub services: &'a dyn Services,
}

impl Context<'_> {
    /// As [`Services::note`].
    pub fn note(&self, line: impl Into<String>) {
        self.services.note(line.into());
    }
    /// As [`Services::warn`].
    pub fn warn(&self, line: impl Into<String>) {
        self.services.warn(line.into());
    }
    /// The same of every line.
    pub fn warn_each(&self, lines: impl IntoIterator<Item = String>) {
        lines.into_iter().for_each(|line| self.services.warn(line));
    }
    /// Takes the lines of a search whose length nobody knows: each is noted, and is a step of what is shown of it.
    pub fn searching(&self, what: &str) -> impl Fn(String) + '_ {
        self.services.begin(what, None, "steps");
        let steps = AtomicU64::new(0);
        move |line| {
            let step = steps.fetch_add(1, Ordering::Relaxed) + 1;
            self.services.advance(step, &line);
            self.services.note(line);
        }
    }
    /// The label and content of a file that should hold `what`, a text of at most so many bytes.
    pub fn text(&self, file: &RawFile, what: &str, most: u64) -> Result<(String, String)> {
        let OpenedInput { label, reader, .. } = self.services.open(file)?;
        let mut bytes = Vec::new();
        let read = reader.take(most + 1).read_to_end(&mut bytes);
        read.map_err(|error| Error::store(&label, error.to_string()))?;
        let is_long = bytes.len() as u64 > most;
        match String::from_utf8(bytes) {
            _ if is_long => {
                let message = format!("longer than {} MB; expected {what}", most >> 20);
                Err(Error::spec(label, message))
            }
            Ok(text) => Ok((label, text)),
            Err(_) => {
                let message = format!("not a text file in UTF-8; expected {what}");
                Err(Error::spec(label, message))
            }
        }
    }
}

/// What a stage is called, and its ports.
pub trait DeclaredStage {
    /// In `uses:` of the YAML.
    const NAME: &'static str;
    /// What it does, in one line.
    const SUMMARY: &'static str;
    /// Bumped by hand whenever equal inputs give other outputs.
    const IMPLEMENTATION: u32;
    /// Tables that it takes.
    type Reads: Reads;
    /// Tables that it gives.
    type Writes: Writes;
}

/// A step of a pipeline: settings (`with:`), typed ports and a body. The settings are the type itself.
pub trait Stage:
    DeclaredStage + DeserializeOwned + Serialize + JsonSchema + Send + Sync + 'static
{
    /// Finds faults of the settings that types cannot express, each at its place below `with`.
    fn faults(&self, _at: &mut Place) {}
    /// All of them.
    fn check(&self) -> Vec<Fault> {
        Place::faults(|at| self.faults(at))
    }
    /// The input files among the settings, each with its path below `with`.
    fn files(&self) -> Vec<(String, RawFile)> {
        Vec::new()
    }
    /// The sets of the split that the settings name, each with its path below `with`.
    fn sets_named(&self) -> Vec<(String, String)> {
        Vec::new()
    }
    /// The sets to which rows are dealt out, where the settings alone say it.
    fn sets_dealt(&self) -> Option<Vec<String>> {
        None
    }
    /// Looks at the input files without doing the work: at their headers, say. `reads` is there where the stages before could be
    /// looked at so far that they gave their tables; fails with every fault, gives its own tables where that is all of the work.
    fn look(
        &self,
        _reads: Option<Self::Reads>,
        _context: &Context,
    ) -> Result<Option<Self::Writes>> {
        Ok(None)
    }
    /// Does the work. Fails with [`crate::error::Error::Data`] where the tables cannot be used.
    fn run(&self, reads: Self::Reads, context: &Context) -> Result<Self::Writes>;
}

/// The sets that are fitted by default.
fn fit_set() -> Vec<String> {
    vec!["fit".into()]
}

fn yes() -> bool {
    true
}

/// A setting `on` names a set; `example` is one.
fn must_name_sets(sets: &[String], example: &str, at: &mut Place) {
    let message = format!("expected at least one set, e.g. [{example}]");
    at.at("on").must(!sets.is_empty(), message);
}

/// The sets of a setting `on`, as [`Stage::sets_named`].
fn on(sets: &[String]) -> Vec<(String, String)> {
    sets.iter()
        .enumerate()
        .map(|(k, set)| (format!("on[{k}]"), set.clone()))
        .collect()
}

/// Stages whose tables are a diagnosis, as `calib diagnose` runs and shows them.
pub const DIAGNOSES: [&str; 3] = [Diagnose::NAME, DiagnoseTorques::NAME, DiagnoseDrives::NAME];

/// Every kind of stage, one line each.
pub const STAGES: &[StageEntry] = &[
    StageEntry::of::<ReadRobot>(),
    StageEntry::of::<ingest::Ingest>(),
    StageEntry::of::<Simulate>(),
    StageEntry::of::<split::SplitBy>(),
    StageEntry::of::<Identify>(),
    StageEntry::of::<Stiffness>(),
    StageEntry::of::<Transfer>(),
    StageEntry::of::<Diagnose>(),
    StageEntry::of::<CellEvidence>(),
    StageEntry::of::<ingest::IngestTorques>(),
    StageEntry::of::<DiagnoseTorques>(),
    StageEntry::of::<TorqueEvidence>(),
    StageEntry::of::<DiagnoseDrives>(),
    StageEntry::of::<Masses>(),
    StageEntry::of::<CompareTorques>(),
    StageEntry::of::<ReportTorques>(),
    StageEntry::of::<ReportDrives>(),
    StageEntry::of::<Compare>(),
    StageEntry::of::<Learn>(),
    StageEntry::of::<Optimise>(),
    StageEntry::of::<Validate>(),
    StageEntry::of::<Report>(),
];

/// A stage with its settings, its type erased.
pub trait ErasedStage: Send + Sync {
    /// As [`Stage::check`].
    fn check(&self) -> Vec<Fault>;
    /// As [`Stage::files`].
    fn files(&self) -> Vec<(String, RawFile)>;
    /// As [`Stage::sets_named`].
    fn sets_named(&self) -> Vec<(String, String)>;
    /// As [`Stage::sets_dealt`].
    fn sets_dealt(&self) -> Option<Vec<String>>;
    /// The settings with defaults filled in; part of the stage's key.
    fn settings(&self) -> serde_json::Value;
    /// As [`Stage::look`], with the tables of each input port where all are known.
    fn look(
        &self,
        inputs: Option<Vec<Vec<(String, InputTable)>>>,
        context: &Context,
    ) -> Result<Option<Vec<Output>>>;
    /// Takes the tables of each input port with the ids of the stages that wrote them.
    fn run(&self, inputs: Vec<Vec<(String, InputTable)>>, context: &Context)
    -> Result<Vec<Output>>;
}

impl<T: Stage> ErasedStage for T {
    fn check(&self) -> Vec<Fault> {
        Stage::check(self)
    }
    fn files(&self) -> Vec<(String, RawFile)> {
        Stage::files(self)
    }
    fn sets_named(&self) -> Vec<(String, String)> {
        Stage::sets_named(self)
    }
    fn sets_dealt(&self) -> Option<Vec<String>> {
        Stage::sets_dealt(self)
    }
    fn settings(&self) -> serde_json::Value {
        serde_json::to_value(self).expect("settings are plain data")
    }
    fn look(
        &self,
        inputs: Option<Vec<Vec<(String, InputTable)>>>,
        context: &Context,
    ) -> Result<Option<Vec<Output>>> {
        let reads = inputs.map(T::Reads::take).transpose()?;
        Stage::look(self, reads, context)?
            .map(Writes::give)
            .transpose()
    }
    fn run(
        &self,
        inputs: Vec<Vec<(String, InputTable)>>,
        context: &Context,
    ) -> Result<Vec<Output>> {
        Stage::run(self, T::Reads::take(inputs)?, context)?.give()
    }
}

/// A stage whose settings are typed, or all their faults.
pub type ParsedStage = Result<Box<dyn ErasedStage>, Vec<Trouble>>;

/// One kind of stage, as the pipeline's YAML names it.
#[derive(Debug, Clone, Copy)]
pub struct StageEntry {
    /// In `uses:` of the YAML.
    pub name: &'static str,
    /// What it does, in one line.
    pub summary: &'static str,
    /// Version of its algorithm.
    pub implementation: u32,
    /// Its input ports.
    pub reads: fn() -> Vec<Port>,
    /// Its output ports.
    pub writes: fn() -> Vec<Port>,
    /// Types the settings; all their faults, with paths below `with`.
    pub parse: fn(&Node) -> ParsedStage,
    /// The JSON Schema of its settings.
    pub schema: fn(&mut SchemaGenerator) -> Schema,
}

impl StageEntry {
    /// The entry of a stage.
    pub const fn of<T: Stage>() -> Self {
        Self {
            name: T::NAME,
            summary: T::SUMMARY,
            implementation: T::IMPLEMENTATION,
            reads: T::Reads::ports,
            writes: T::Writes::ports,
            parse: |settings| Ok(Box::new(typed::<T>(settings)?)),
            schema: |generator| generator.subschema_for::<T>(),
        }
    }
}

/// Declares a stage with its ports: `stage! { Identify, "identify", 18, "identifies geometry", IdentifyReads { robot: Robot, } -> Identified }`. A
/// struct of ports without fields is declared elsewhere.
#[macro_export]
macro_rules! stage {
    ($stage:ty, $name:literal, $implementation:literal, $summary:literal,
     $reads:ident $({ $($read:tt)* })? -> $writes:ident $({ $($written:tt)* })?) => {
        $(::calib_table::reads! {
            #[doc = concat!("Input ports of `", $name, "`.")]
            pub struct $reads { $($read)* }
        })?
        $(::calib_table::writes! {
            #[doc = concat!("Output ports of `", $name, "`.")]
            pub struct $writes { $($written)* }
        })?
        impl $crate::DeclaredStage for $stage {
            const NAME: &'static str = $name;
            const SUMMARY: &'static str = $summary;
            const IMPLEMENTATION: u32 = $implementation;
            type Reads = $reads;
            type Writes = $writes;
        }
    };
}
