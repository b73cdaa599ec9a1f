//! What the engine does for a running stage: files, sinks, progress and lines that are kept.

use crate::error::{Error, Result};
use crate::raw;
use crate::stage::{OpenedInput, RawFile, Services, Sink, Streamed};
use crate::store::frame::Frame;
use crate::store::{FinishedFile, Store, TableWriter};
use std::sync::{Mutex, PoisonError};

/// Whoever watches a run: a terminal, a log, nobody.
pub trait Observer: Sync {
    /// A stage starts to execute, with the reason.
    fn stage_begins(&self, _id: &str, _uses: &str, _reason: &str) {}
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
    pub(crate) fn lines(self) -> StageMessages {
        self.lines
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

impl Services for StageServices<'_> {
    fn open(&self, file: &RawFile) -> Result<OpenedInput> {
        open(self.id, self.files, file)
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
        self.lines
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .notes
            .push(line);
    }
    fn warn(&self, line: String) {
        self.observer.warn(self.id, &line);
        self.lines
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .warnings
            .push(line);
    }
}

/// Opens an input file that the stage listed; settings hold paths as text, whatever bytes they have.
pub(super) fn open(
    id: &str,
    files: &[super::plan::InputFile],
    file: &RawFile,
) -> Result<OpenedInput> {
    let asked = file.0.to_string_lossy();
    let Some(known) = files
        .iter()
        .find(|known| known.path.to_string_lossy() == asked)
    else {
        return Err(Error::Bug(format!(
            "stage {id} opens {asked} without listing it among its files"
        )));
    };
    let shown = known.path.display().to_string();
    let mut reader = raw::source(&known.path).map_err(|error| Error::unreadable(&shown, &error))?;
    let size = reader
        .bounds()
        .ok()
        .and_then(|bounds| bounds.last().copied());
    Ok(OpenedInput {
        label: label_of(files, known),
        reader,
        size,
    })
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
        let file: FinishedFile = self.writer.finish()?;
        Ok(Streamed {
            kind: self.kind,
            handle: Box::new(file),
        })
    }
}
