//! Stages without their types, so that a pipeline can hold any of them.

use super::{Context, InputTable, Output, Port, RawFile, Reads, Stage, Writes};
use crate::error::{Fault, Result};
use crate::yaml::{Node, Trouble, typed};
use schemars::{Schema, SchemaGenerator};

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
pub(crate) type ParsedStage = Result<Box<dyn ErasedStage>, Vec<Trouble>>;

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
    pub(crate) schema: fn(&mut SchemaGenerator) -> Schema,
}

impl StageEntry {
    /// The entry of a stage.
    pub(crate) const fn of<T: Stage>() -> Self {
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
macro_rules! stage {
    ($stage:ty, $name:literal, $implementation:literal, $summary:literal,
     $reads:ident $({ $($read:tt)* })? -> $writes:ident $({ $($written:tt)* })?) => {
        $(crate::table::reads! {
            #[doc = concat!("Input ports of `", $name, "`.")]
            pub struct $reads { $($read)* }
        })?
        $(crate::table::writes! {
            #[doc = concat!("Output ports of `", $name, "`.")]
            pub struct $writes { $($written)* }
        })?
        impl crate::stage::DeclaredStage for $stage {
            const NAME: &'static str = $name;
            const SUMMARY: &'static str = $summary;
            const IMPLEMENTATION: u32 = $implementation;
            type Reads = $reads;
            type Writes = $writes;
        }
    };
}
pub(crate) use stage;
