//! What the engine does for a running stage: files, sinks, progress and lines that are kept.

use crate::error::{Error, Fault, Result, nearest};
use crate::pipeline::spec::InputFile;
use crate::raw;
use crate::stage::{
    Arity, Context, InputTable, OpenedInput, Output, RawFile, STAGES, Services, Sink, Streamed,
};
use crate::store::frame::Frame;
use crate::store::{Store, TableWriter};
use crate::yaml::{self, Trouble};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whoever watches a run: a terminal, a log, nobody.
pub trait Observer: Sync {
    /// A stage starts to execute, with the reason.
    fn stage_begins(&self, _id: &str, _uses: &str, _reason: &str) {}
    /// It will take about so many seconds, estimated from its last run.
    fn expects(&self, _id: &str, _seconds: f64) {}
    /// It waits for another process.
    fn waits(&self, _id: &str, _line: &str) {}
    /// A stage is over; the report says how.
    fn stage_ends(&self, _report: &super::manifest::StageReport) {}
    /// Units of work: what is done, how many in all, and what a unit is called.
    fn begin(&self, _id: &str, _what: &str, _total: Option<u64>, _unit: &str) {}
    /// So much of the bar of a stage is done.
    fn advance(&self, _id: &str, _done: u64, _message: &str) {}
    /// Lines while the stage runs; they are in its report too.
    fn note(&self, _id: &str, _line: &str) {}
    /// A warning of a stage.
    fn warn(&self, _id: &str, _line: &str) {}
}

/// What an observer unwinds with where nobody waits for the run any more: the stage ends as interrupted.
pub struct Interrupted;

/// Nobody watches.
pub struct Unwatched;

impl Observer for Unwatched {}

pub(super) struct StageServices<'a> {
    pub(crate) id: &'a str,
    /// None where tables stay in memory.
    pub(crate) store: Option<&'a Store>,
    pub(crate) files: &'a [super::plan::InputFile],
    pub(crate) observer: &'a dyn Observer,
    lines: Mutex<StageMessages>,
}

/// What a stage told the person.
#[derive(Debug, Clone, Default)]
pub(super) struct StageMessages {
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

impl<'a> StageServices<'a> {
    pub(crate) fn new(
        id: &'a str,
        store: Option<&'a Store>,
        files: &'a [super::plan::InputFile],
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            id,
            store,
            files,
            observer,
            lines: Mutex::default(),
        }
    }
    fn locked(&self) -> MutexGuard<'_, StageMessages> {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner)
    }
    pub(crate) fn lines(self) -> StageMessages {
        self.lines
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Services for StageServices<'_> {
    /// Opens an input file that the stage listed; settings hold paths as text, whatever bytes they have.
    fn open(&self, file: &RawFile) -> Result<OpenedInput> {
        let asked = file.0.to_string_lossy();
        let mut files = self.files.iter();
        let Some(known) = files.find(|known| known.path.to_string_lossy() == asked) else {
            return Err(Error::Bug(format!(
                "stage {} opens {asked} without listing it among its files",
                self.id
            )));
        };
        let shown = known.path.display().to_string();
        let mut reader =
            raw::source(&known.path).map_err(|error| Error::unreadable(&shown, &error))?;
        let bounds = reader.bounds();
        Ok(OpenedInput {
            label: label_of(self.files, known),
            reader,
            size: bounds.ok().and_then(|bounds| bounds.last().copied()),
        })
    }
    fn sink(&self, kind: &'static str) -> Result<Box<dyn Sink>> {
        let Some(store) = self.store else {
            let message = "writes a table that may be longer than memory: run it in a pipeline";
            return Err(Error::spec(self.id, message));
        };
        Ok(Box::new(StoreSink {
            kind,
            writer: store.writer(kind)?,
        }))
    }
    fn begin(&self, what: &str, total: Option<u64>, unit: &str) {
        self.observer.begin(self.id, what, total, unit);
    }
    fn advance(&self, done: u64, message: &str) {
        self.observer.advance(self.id, done, message);
    }
    fn note(&self, line: String) {
        self.observer.note(self.id, &line);
        self.locked().notes.push(line);
    }
    fn warn(&self, line: String) {
        self.observer.warn(self.id, &line);
        self.locked().warnings.push(line);
    }
}

/// A file in messages: by its name, and where the stage has another file of that name, as the YAML names it.
fn label_of(files: &[super::plan::InputFile], file: &super::plan::InputFile) -> String {
    let name = label(&file.path);
    let shared = files
        .iter()
        .any(|other| other.path != file.path && label(&other.path) == name);
    if shared {
        file.named.display().to_string()
    } else {
        name
    }
}

/// A file as tables name it: its name alone, so that equal content gives equal tables wherever it lies.
pub(super) fn label(path: &std::path::Path) -> String {
    path.file_name().map_or_else(
        || path.display().to_string(),
        |name| name.to_string_lossy().into_owned(),
    )
}

struct StoreSink {
    kind: &'static str,
    writer: TableWriter,
}

impl Sink for StoreSink {
    fn push(&mut self, chunk: Frame) -> Result<()> {
        self.writer.push(&chunk)
    }
    fn finish(self: Box<Self>) -> Result<Streamed> {
        Ok(Streamed {
            kind: self.kind,
            file: Some(self.writer.finish()?),
        })
    }
}

/// Which stage, and how.
pub struct StageCall<'a> {
    /// As `uses:` of a pipeline names it; its id too.
    pub(crate) uses: &'a str,
    /// Its settings, as `with:` of a pipeline.
    pub(crate) with: &'a serde_json::Value,
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
        let matching = tables.iter().filter(|frame| frame.kind() == port.kind);
        let taken: Vec<(String, InputTable)> = matching
            .map(|frame| (frame.kind().into(), InputTable::Frame(frame.clone())))
            .collect();
        if taken.is_empty() && port.arity == Arity::One {
            return Err(Error::spec(id, format!("reads a table `{}`", port.kind)));
        }
        Ok(taken)
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

/// The seed of a stage: its own, so that stages do not share random numbers.
pub(super) fn seed(pipeline: u64, id: &str) -> u64 {
    let hash = blake3::hash(format!("{pipeline} {id}").as_bytes());
    u64::from_le_bytes(*hash.as_bytes().first_chunk().expect("a hash has 32 bytes"))
}
