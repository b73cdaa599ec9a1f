//! Stages: pure functions from tables to tables. One file each, one line each in [`STAGES`].

mod advice;
mod blank_payload;
mod cell_evidence;
mod compare;
mod compare_torques;
mod computed;
mod contact;
mod copied;
mod curves;
mod declared_effects;
mod diagnose;
mod diagnose_torques;
mod doubtful;
mod dynamic_arm;
mod folding;
mod identified;
mod identify;
pub mod ingest;
mod known_cell;
pub mod learn;
mod masses;
mod misplaced_tool;
mod named_column;
mod optimise;
mod parameter_set;
mod registry;
mod repeated;
mod report;
mod report_torques;
mod robot;
mod rounded;
mod screened;
mod simulate;
pub mod split;
mod stiffness;
mod stored;
mod text_file;
mod torque_signal;
mod transfer;
mod unmoved;
mod validate;
mod weightless;

pub use cell_evidence::{CellEvidence, CellEvidenceWrites, Given};
pub use compare::{Compare, CompareReads};
pub use compare_torques::{CompareTorques, CompareTorquesReads};
use diagnose::AskedRows;
pub use diagnose::{CellPrior, Diagnose, DiagnoseReads};
pub use diagnose_torques::{
    ConsistencySetting, DiagnoseTorques, DiagnoseTorquesReads, DiagnoseTorquesWrites, HoldOut,
    InertialSetting,
};
pub(crate) use dynamic_arm::{dynamic_arm, must_be_bodies, torque_per_ampere};
pub use folding::FoldSetting;
pub use identify::{Identify, IdentifyReads};
pub use learn::{Learn, LearnReads, LearnWrites};
pub use masses::{Masses, MassesReads, MassesWrites};
pub use optimise::{BenchmarkProblem, Optimise, OptimiseReads};
pub(crate) use parameter_set::matches;
pub use registry::{ErasedStage, StageEntry};
pub use report::{Accepted, Report, ReportReads};
pub use report_torques::{ReportTorques, ReportTorquesReads, ReportTorquesWrites};
pub use robot::{ReadRobot, RobotFormat, RobotReads, RobotWrites};
pub use simulate::{Remainder, Simulate, SimulateReads, SimulateWrites};
pub use stiffness::{Stiffness, StiffnessReads};
pub use stored::{Chunks, InputTable, StoredTable};
pub use transfer::{Transfer, TransferReads};
pub use validate::{Validate, ValidateReads};

use crate::error::{Fault, Place, Result};
use crate::raw::InputSource;
use crate::table::{Frame, Table};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::path::PathBuf;

/// How many upstream tables a port takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arity {
    /// The latest upstream stage that writes this kind, or the one named in `reads:`.
    One,
    /// The same, or none.
    Optional,
    /// All upstream stages that write this kind, in pipeline order.
    Every,
}

/// A named input or output of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Port {
    /// In `reads:` of the YAML.
    pub name: &'static str,
    /// The name of the schema.
    pub kind: &'static str,
    /// How many tables it takes.
    pub arity: Arity,
    /// Whether its table is read chunk by chunk.
    pub chunked: bool,
}

/// What a field of a `reads!` struct may be: `T`, `Option<T>`, `Vec<Labelled<T>>` or `Chunks<T>`.
pub trait PortValue: Sized {
    /// How many tables it takes.
    const ARITY: Arity;
    /// The name of the schema.
    const KIND: &'static str;
    /// Whether it is read chunk by chunk.
    const CHUNKED: bool = false;
    /// The value from the tables that were wired to the port.
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self>;
}

/// A table together with the id of the stage that wrote it.
#[derive(Debug, Clone)]
pub struct Labelled<T> {
    /// Its id.
    pub stage: String,
    /// What it wrote.
    pub table: T,
}

impl<T: Table> PortValue for T {
    const ARITY: Arity = Arity::One;
    const KIND: &'static str = T::KIND;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        T::from_frame(
            &inputs
                .first()
                .expect("the plan wired this port")
                .1
                .frame()?,
        )
    }
}
impl<T: Table> PortValue for Option<T> {
    const ARITY: Arity = Arity::Optional;
    const KIND: &'static str = T::KIND;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        inputs
            .first()
            .map(|(_, input)| T::from_frame(&input.frame()?))
            .transpose()
    }
}
impl<T: Table> PortValue for Vec<Labelled<T>> {
    const ARITY: Arity = Arity::Every;
    const KIND: &'static str = T::KIND;
    fn take(inputs: Vec<(String, InputTable)>) -> Result<Self> {
        inputs
            .into_iter()
            .map(|(stage, input)| {
                Ok(Labelled {
                    stage,
                    table: T::from_frame(&input.frame()?)?,
                })
            })
            .collect()
    }
}

/// The input ports of a stage.
pub trait Reads: Sized {
    /// In the order of the fields.
    fn ports() -> Vec<Port>;
    /// Takes the tables of each port, in the order of [`Reads::ports`].
    fn take(inputs: Vec<Vec<(String, InputTable)>>) -> Result<Self>;
}

/// The output ports of a stage.
pub trait Writes: Sized {
    /// In the order of the fields.
    fn ports() -> Vec<Port>;
    /// Checked columns, in the order of the ports. Fails where a value breaks its schema.
    fn give(self) -> Result<Vec<Output>>;
}

/// What a stage hands back on one port: columns in memory, or a table already streamed through [`Services::sink`].
pub enum Output {
    /// Columns in memory.
    Frame(Frame),
    /// A finished file.
    Streamed(Streamed),
}

/// Declares input ports: `reads! { pub struct IdentifyReads { robot: Robot, parameters: Option<Parameters>, } }`.
macro_rules! reads {
    ($(#[$doc:meta])* pub struct $name:ident { $( $field:ident: $ty:ty, )* }) => {
        $(#[$doc])*
        pub struct $name { $(
            #[doc = concat!("The port `", stringify!($field), "`.")]
            pub $field: $ty,
        )* }
        impl crate::stage::Reads for $name {
            fn ports() -> Vec<crate::stage::Port> {
                vec![ $( crate::stage::Port { name: stringify!($field), kind: <$ty as crate::stage::PortValue>::KIND, arity: <$ty as crate::stage::PortValue>::ARITY, chunked: <$ty as crate::stage::PortValue>::CHUNKED } ),* ]
            }
            #[allow(unused_mut, unused_variables)]
            fn take(inputs: Vec<Vec<(String, crate::stage::InputTable)>>) -> crate::error::Result<Self> {
                let mut inputs = inputs.into_iter();
                Ok(Self { $( $field: <$ty as crate::stage::PortValue>::take(inputs.next().expect("one entry per port"))?, )* })
            }
        }
    };
}

/// What a field of a `writes!` struct may be: a table, or a [`Streamed`] one.
pub trait Produced {
    /// The name of the schema.
    const KIND: &'static str;
    /// Checked columns, or the finished file.
    fn give(self) -> Result<Output>;
}
impl<T: Table> Produced for T {
    const KIND: &'static str = T::KIND;
    fn give(self) -> Result<Output> {
        self.to_frame().map(Output::Frame)
    }
}

/// Declares output ports: `writes! { pub struct IdentifyWrites { parameters: Parameters, } }`.
macro_rules! writes {
    ($(#[$doc:meta])* pub struct $name:ident { $( $field:ident: $ty:ty, )* }) => {
        $(#[$doc])*
        pub struct $name { $(
            #[doc = concat!("The port `", stringify!($field), "`.")]
            pub $field: $ty,
        )* }
        impl crate::stage::Writes for $name {
            fn ports() -> Vec<crate::stage::Port> {
                vec![ $( crate::stage::Port { name: stringify!($field), kind: <$ty as crate::stage::Produced>::KIND, arity: crate::stage::Arity::One, chunked: false } ),* ]
            }
            fn give(self) -> crate::error::Result<Vec<crate::stage::Output>> {
                Ok(vec![ $( crate::stage::Produced::give(self.$field)? ),* ])
            }
        }
    };
}
#[allow(unused_imports)]
pub(crate) use {reads, writes};

/// A table written chunk by chunk, for what does not fit into memory.
pub struct Streamed {
    /// The name of the schema.
    pub kind: &'static str,
    /// How many.
    pub rows: u64,
    /// The engine's handle to the finished file.
    pub handle: Box<dyn std::any::Any + Send>,
}

/// A streamed table with its kind as a type, for a field of a `writes!` struct.
pub struct StreamedTable<T>(Streamed, std::marker::PhantomData<fn() -> T>);

impl<T: Table> StreamedTable<T> {
    /// A finished table of this kind; panics where it is another.
    pub fn new(streamed: Streamed) -> Self {
        assert_eq!(streamed.kind, T::KIND, "a sink of another kind");
        Self(streamed, std::marker::PhantomData)
    }
}
impl<T: Table> Produced for StreamedTable<T> {
    const KIND: &'static str = T::KIND;
    fn give(self) -> Result<Output> {
        Ok(Output::Streamed(self.0))
    }
}

/// Takes chunks of one table, in key order, and checks each against the schema.
pub trait Sink: Send {
    /// Takes rows. Fails where they break the schema or the order of the key.
    fn push(&mut self, chunk: Frame) -> Result<()>;
    /// Ends the table.
    fn finish(self: Box<Self>) -> Result<Streamed>;
}

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
}

/// A step of a pipeline: settings (`with:`), typed ports and a body. The settings are the type itself.
pub trait Stage: DeserializeOwned + Serialize + JsonSchema + Send + Sync + 'static {
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

/// A setting `on` names a set; `example` is one.
fn must_name_sets(sets: &[String], example: &str, at: &mut Place) {
    at.at("on").must(
        !sets.is_empty(),
        format!("expected at least one set, e.g. [{example}]"),
    );
}

/// The sets of a setting `on`, as [`Stage::sets_named`].
fn on(sets: &[String]) -> Vec<(String, String)> {
    sets.iter()
        .enumerate()
        .map(|(k, set)| (format!("on[{k}]"), set.clone()))
        .collect()
}

/// Stages whose tables are a diagnosis, as `calib diagnose` runs and shows them.
pub const DIAGNOSES: [&str; 2] = [Diagnose::NAME, DiagnoseTorques::NAME];

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
    StageEntry::of::<Masses>(),
    StageEntry::of::<CompareTorques>(),
    StageEntry::of::<ReportTorques>(),
    StageEntry::of::<Compare>(),
    StageEntry::of::<Learn>(),
    StageEntry::of::<Optimise>(),
    StageEntry::of::<Validate>(),
    StageEntry::of::<Report>(),
];
