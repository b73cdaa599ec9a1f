//! A stage on tables in memory: as in a pipeline, without a store and without a file.

use super::run_state::seed;
use super::services::{Observer, StageServices};
use super::spec::InputFile;
use crate::error::{Error, Fault, Result, nearest};
use crate::stage::{Arity, Context, InputTable, Output, STAGES};
use crate::store::frame::Frame;
use crate::yaml::{self, Trouble};

/// Which stage, and how.
pub struct StageCall<'a> {
    /// As `uses:` of a pipeline names it; its id too.
    pub(crate) uses: &'a str,
    /// Its settings, as `with:` of a pipeline.
    pub(crate) with: &'a serde_json::Value,
    /// That of the pipeline.
    pub(crate) seed: u64,
}

/// What a stage gave.
#[derive(Debug, Clone, Default)]
pub struct StageTables {
    /// By the names of the ports.
    pub tables: Vec<(&'static str, Frame)>,
    /// What it noted.
    pub notes: Vec<String>,
    /// What it warned of.
    pub warnings: Vec<String>,
}

impl StageTables {
    /// The table of a kind, if there is one.
    pub(crate) fn kind(&self, kind: &str) -> Option<&Frame> {
        let mut frames = self.tables.iter().map(|(_, frame)| frame);
        frames.find(|frame| frame.kind() == kind)
    }
}

/// Runs a stage on the tables that its ports take, by their kinds. Fails as in a pipeline; settings have their path below `with`.
pub fn run_in_memory(
    call: &StageCall,
    tables: &[Frame],
    observer: &dyn Observer,
) -> Result<StageTables> {
    let id = call.uses;
    let entry = STAGES.iter().find(|entry| entry.name == id);
    let entry = entry.ok_or_else(|| {
        let near = nearest(id, STAGES.iter().map(|entry| entry.name)).unwrap_or_default();
        Error::spec("uses", format!("no stage `{id}`; did you mean `{near}`?"))
    })?;
    // JSON is YAML: the same reader tells the same faults.
    let (node, troubles) = yaml::parse(&call.with.to_string());
    // A place in a text that nobody wrote helps nobody.
    let fault = |mut trouble: Trouble| {
        trouble.mark = None;
        trouble.below("with").fault(id)
    };
    let faults = |troubles: Vec<Trouble>| Error::Spec(troubles.into_iter().map(fault).collect());
    let node = node.filter(|_| troubles.is_empty());
    let stage = (entry.parse)(&node.ok_or_else(|| faults(troubles))?).map_err(faults)?;
    let wrong = stage.check();
    if !wrong.is_empty() {
        let placed =
            |fault: Fault| Fault::new(format!("{id}: with.{}", fault.place), fault.message);
        return Err(Error::Spec(wrong.into_iter().map(placed).collect()));
    }
    let files = stage.files().into_iter().map(|(place, raw)| InputFile {
        place,
        path: raw.0.clone(),
        named: raw.0,
    });
    let files: Vec<InputFile> = files.collect();
    let inputs = (entry.reads)().into_iter().map(|port| {
        let own = tables.iter().filter(|frame| frame.kind() == port.kind);
        let own: Vec<(String, InputTable)> = own
            .map(|frame| (frame.kind().into(), Box::new(frame.clone()) as InputTable))
            .collect();
        if own.is_empty() && port.arity == Arity::One {
            return Err(Error::spec(id, format!("reads a table `{}`", port.kind)));
        }
        Ok(own)
    });
    let inputs = inputs.collect::<Result<Vec<_>>>()?;
    let services = StageServices::new(id, None, &files, observer);
    let context = Context {
        id,
        seed: seed(call.seed, id),
        jobs: rayon::current_num_threads(),
        services: &services,
    };
    let outputs = stage.run(inputs, &context)?;
    let named = (entry.writes)().into_iter().zip(outputs);
    let frames = named.filter_map(|(port, output)| match output {
        Output::Frame(frame) => Some((port.name, frame)),
        Output::Streamed(_) => None,
    });
    let tables = frames.collect();
    let lines = services.lines();
    Ok(StageTables {
        tables,
        notes: lines.notes,
        warnings: lines.warnings,
    })
}
