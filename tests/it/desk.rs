//! A stand-in for the engine: runs a stage on files in memory and keeps what it writes.

use calib::error::{Error, Result};
use calib::stage::{
    Context, DiagnoseReads, ErasedStage, IdentifyReads, InputTable, OpenedInput, Output, Port,
    RawFile, Services, Sink, Stage, StageEntry, Streamed, Writes,
};
use calib::store::frame::Frame;
use calib::table::{Recording, Robot, Split, Table};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

type Chunks = Arc<Mutex<BTreeMap<&'static str, Vec<Frame>>>>;

/// Files, and everything a stage says.
pub struct Desk {
    pub seed: u64,
    pub jobs: usize,
    files: BTreeMap<PathBuf, Vec<u8>>,
    pub notes: Mutex<Vec<String>>,
    pub warnings: Mutex<Vec<String>>,
    chunks: Chunks,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            seed: 7,
            jobs: 1,
            files: Default::default(),
            notes: Default::default(),
            warnings: Default::default(),
            chunks: Default::default(),
        }
    }
}

impl Desk {
    /// Puts a file where settings find it by name.
    pub fn with(mut self, name: &str, content: impl Into<Vec<u8>>) -> Self {
        self.files.insert(name.into(), content.into());
        self
    }
    /// Runs a stage and gives the chunks of each table that it wrote.
    pub fn run<S: Stage>(
        &self,
        stage: &S,
        reads: S::Reads,
    ) -> Result<BTreeMap<&'static str, Vec<Frame>>> {
        self.written(&S::Writes::ports(), |context| {
            stage.run(reads, context)?.give()
        })
    }
    /// The same of a stage whose type is not known, on the tables of each of its ports.
    pub fn run_any(
        &self,
        entry: &StageEntry,
        stage: &dyn ErasedStage,
        frames: Vec<Vec<(String, Frame)>>,
    ) -> Result<BTreeMap<&'static str, Vec<Frame>>> {
        let input = |(stage, frame): (String, Frame)| (stage, InputTable::Frame(frame));
        let inputs = frames
            .into_iter()
            .map(|port| port.into_iter().map(input).collect())
            .collect();
        self.written(&(entry.writes)(), |context| stage.run(inputs, context))
    }
    /// Runs what gives the tables of these ports.
    pub fn written(
        &self,
        ports: &[Port],
        run: impl FnOnce(&Context) -> Result<Vec<Output>>,
    ) -> Result<BTreeMap<&'static str, Vec<Frame>>> {
        self.chunks.lock().unwrap().clear();
        let outputs = run(&Context {
            id: "stage",
            seed: self.seed,
            jobs: self.jobs,
            services: self,
        })?;
        let mut tables = std::mem::take(&mut *self.chunks.lock().unwrap());
        for (port, output) in ports.iter().zip(outputs) {
            match output {
                Output::Frame(frame) => drop(tables.insert(port.kind, vec![frame])),
                Output::Streamed(streamed) => assert_eq!(streamed.kind, port.kind),
            }
        }
        Ok(tables)
    }
}

/// The chunks of one table as Rust values.
pub fn table<T: Table>(tables: &BTreeMap<&'static str, Vec<Frame>>) -> Vec<T> {
    tables[T::KIND]
        .iter()
        .map(|frame| T::from_frame(frame).unwrap())
        .collect()
}

struct Keep {
    kind: &'static str,
    frames: Vec<Frame>,
    chunks: Chunks,
}

impl Sink for Keep {
    fn push(&mut self, chunk: Frame) -> Result<()> {
        assert_eq!(chunk.kind(), self.kind);
        self.frames.push(chunk);
        Ok(())
    }
    fn finish(self: Box<Self>) -> Result<Streamed> {
        self.chunks.lock().unwrap().insert(self.kind, self.frames);
        Ok(Streamed {
            kind: self.kind,
            file: None,
        })
    }
}

impl Services for Desk {
    fn open(&self, file: &RawFile) -> Result<OpenedInput> {
        let label = file.0.display().to_string();
        if let Some(content) = self.files.get(&file.0) {
            let reader = Box::new(std::io::Cursor::new(content.clone()));
            return Ok(OpenedInput {
                label,
                reader,
                size: Some(content.len() as u64),
            });
        }
        let reader =
            std::fs::File::open(&file.0).map_err(|error| Error::data(&label, error.to_string()))?;
        Ok(OpenedInput {
            label,
            reader: Box::new(reader),
            size: None,
        })
    }
    fn sink(&self, kind: &'static str) -> Result<Box<dyn Sink>> {
        Ok(Box::new(Keep {
            kind,
            frames: Vec::new(),
            chunks: self.chunks.clone(),
        }))
    }
    fn begin(&self, _what: &str, _total: Option<u64>, _unit: &str) {}
    fn advance(&self, _done: u64, _message: &str) {}
    fn note(&self, line: String) {
        self.notes.lock().unwrap().push(line);
    }
    fn warn(&self, line: String) {
        self.warnings.lock().unwrap().push(line);
    }
}

/// Real recordings beside the repository; or `None`, and the test is listed as skipped when all have run (tests/skipped.rs). Where
/// `CALIB_ALL_TESTS` is set nothing is skipped.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("CALIB_SHARED").map(PathBuf::from);
    let root = root.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"));
    let path = root.join(folder);
    if !path.is_dir() {
        missing(&format!("{} is missing", path.display()));
        return None;
    }
    Some(path)
}

/// Skips this test, or a part of it, for want of recordings, where that is allowed.
pub fn missing(why: &str) {
    assert!(
        std::env::var_os("CALIB_ALL_TESTS").is_none(),
        "nothing may be skipped here: {why}"
    );
    skipped(why);
}

/// Notes that this test, or a part of it, has nothing to test.
pub fn skipped(why: &str) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("skipped");
    std::fs::create_dir_all(&folder).unwrap();
    let test = std::thread::current().name().unwrap().replace("::", " ");
    let mut notes = std::fs::OpenOptions::new()
        .create(true)
        .append(true)
        .open(folder.join(test))
        .unwrap();
    writeln!(notes, "{why}").unwrap();
}

pub fn identify_reads(robot: Robot, recording: Recording, split: Split) -> IdentifyReads {
    IdentifyReads {
        robot,
        recording,
        split,
    }
}

pub fn diagnose_reads(robot: Robot, recording: Recording, split: Split) -> DiagnoseReads {
    DiagnoseReads {
        robot,
        recording,
        split,
    }
}
