//! How far a plan is: which tables every stage has, and from them the key of the next.

use super::plan::{Plan, PlannedStage};
use super::services::{label, seed};
use crate::error::{Error, Result};
use crate::raw;
use crate::stage::Arity;
use crate::store::{
    ActionId, Claim, FileHash, FileKey, KEY_FORMAT, ReadKey, StageKey, Store, TableRef, schema,
};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

pub(super) struct RunState<'a> {
    pub(crate) plan: &'a Plan,
    /// Tables by port, for every stage whose tables are known.
    pub(crate) tables: Vec<Option<BTreeMap<String, TableRef>>>,
    hashes: BTreeMap<PathBuf, HashedFile>,
}

/// The content of a raw input file, and what the file looked like before it was hashed.
struct HashedFile {
    content: FileHash,
    look: Option<FileLook>,
}

impl HashedFile {
    fn read(path: &Path) -> Result<Self> {
        // First the look: of a file that is written meanwhile it is an old one.
        let look = look(path);
        let content = raw::source(path).and_then(FileHash::of_reader);
        let content =
            content.map_err(|error| Error::unreadable(path.display().to_string(), &error))?;
        Ok(Self { content, look })
    }
}

/// Size and time of the last change: where these stay, so did the content.
type FileLook = (u64, SystemTime);

/// None where the file or its system does not tell, and of a folder of parts.
fn look(path: &Path) -> Option<FileLook> {
    let metadata = std::fs::metadata(path)
        .ok()
        .filter(std::fs::Metadata::is_file)?;
    Some((metadata.len(), metadata.modified().ok()?))
}

/// The key of a stage, or the stage whose tables must be there first.
pub(super) enum KeyState {
    Known(StageKey),
    Pending(usize),
}

impl<'a> RunState<'a> {
    pub(crate) fn new(plan: &'a Plan) -> Self {
        Self {
            plan,
            tables: vec![None; plan.stages.len()],
            hashes: BTreeMap::new(),
        }
    }

    pub(crate) fn key(&mut self, index: usize) -> Result<KeyState> {
        let stage = &self.plan.stages[index];
        let mut reads = BTreeMap::new();
        for input in &stage.inputs {
            let mut keys = Vec::new();
            for origin in &input.from {
                let Some(tables) = &self.tables[origin.stage] else {
                    return Ok(KeyState::Pending(origin.stage));
                };
                let table = table(tables, &self.plan.stages[origin.stage], origin.port)?;
                // Only where a port takes several tables does the stage see whose they are.
                let writer = (input.port.arity == Arity::Every)
                    .then(|| self.plan.stages[origin.stage].id.clone());
                keys.push(ReadKey {
                    stage: writer,
                    table: table.table_hash.clone(),
                });
            }
            reads.insert(input.port.name.to_string(), keys);
        }
        self.hash_all(index)?;
        let mut files = BTreeMap::new();
        for file in &stage.files {
            let key = FileKey {
                name: label(&file.path),
                content: self.hash(&file.path)?,
            };
            files.insert(file.place.clone(), key);
        }
        let mut schemas = BTreeMap::new();
        for port in &stage.outputs {
            schemas.insert(port.name.to_string(), schema::of(port.kind)?.id());
        }
        Ok(KeyState::Known(StageKey {
            key_format: KEY_FORMAT,
            id: stage.id.clone(),
            stage: stage.entry.name.into(),
            implementation: stage.entry.implementation,
            settings: stage.stage.settings(),
            reads,
            files,
            schemas,
            seed: self.seed(index),
        }))
    }

    /// The seed of a stage.
    pub(crate) fn seed(&self, index: usize) -> u64 {
        seed(self.plan.seed, &self.plan.stages[index].id)
    }

    /// The hash of a raw input file, read once a run.
    pub(crate) fn hash(&mut self, path: &Path) -> Result<FileHash> {
        if let Some(hashed) = self.hashes.get(path) {
            return Ok(hashed.content.clone());
        }
        let hashed = HashedFile::read(path)?;
        let content = hashed.content.clone();
        self.hashes.insert(path.into(), hashed);
        Ok(content)
    }

    /// Hashes the raw input files of a stage side by side.
    fn hash_all(&mut self, index: usize) -> Result<()> {
        let mut fresh: Vec<&PathBuf> = Vec::new();
        for path in self.plan.stages[index].files.iter().map(|file| &file.path) {
            if !self.hashes.contains_key(path) && !fresh.contains(&path) {
                fresh.push(path);
            }
        }
        let hashed: Vec<Result<HashedFile>> = fresh
            .par_iter()
            .map(|path| HashedFile::read(path))
            .collect();
        for (path, hashed) in fresh.into_iter().zip(hashed) {
            self.hashes.insert(path.clone(), hashed?);
        }
        Ok(())
    }

    /// Fails where a raw input file of a stage is no longer what the stage's key says: its tables would stand under the key of another
    /// content, in this run and in all that follow.
    pub(crate) fn unchanged(&mut self, index: usize) -> Result<()> {
        let stage = &self.plan.stages[index];
        for file in &stage.files {
            let Some(hashed) = self.hashes.get(&file.path) else {
                continue;
            };
            if hashed.look.is_some() && hashed.look == look(&file.path) {
                continue;
            }
            let before = hashed.content.clone();
            self.hashes.remove(&file.path);
            if self.hash(&file.path)? != before {
                let message = format!(
                    "the file changed while stage `{}` waited or ran: nothing of the stage was kept; give the same command again when \
                     nobody writes the file",
                    stage.id
                );
                return Err(Error::store(file.path.display().to_string(), message));
            }
        }
        Ok(())
    }
}

/// The table of an output port, which the record of a stage must have.
pub(super) fn table<'t>(
    tables: &'t BTreeMap<String, TableRef>,
    stage: &PlannedStage,
    port: usize,
) -> Result<&'t TableRef> {
    let name = stage.outputs[port].name;
    tables.get(name).ok_or_else(|| {
        Error::Bug(format!(
            "the record of stage {} has no table {name}",
            stage.id
        ))
    })
}

/// How long a run waits for another that does the same; after that it does the work itself.
const PATIENCE: Duration = Duration::from_secs(600);
const PAUSE: Duration = Duration::from_millis(50);

/// The claim on an action, after waiting for whoever has it; `waiting` is called once, with the process that has it where that is known.
pub(super) fn claim(
    store: &Store,
    action: &ActionId,
    waiting: &mut dyn FnMut(Option<u32>),
) -> Option<Claim> {
    let path = store.root().join("locks").join(format!("{action}.lock"));
    let mut waited = Duration::ZERO;
    loop {
        let claim = Claim::take(&path);
        if claim.is_some() || waited >= PATIENCE {
            return claim;
        }
        if waited.is_zero() {
            waiting(Claim::holder(&path));
        }
        std::thread::sleep(PAUSE);
        waited += PAUSE;
    }
}
