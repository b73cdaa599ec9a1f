//! Columns: schemas, checked frames, content-addressed objects, action records and runs. Knows no robot.
//!
//! `format.json` | `objects/ab/<file hash>.parquet` | `actions/cd/<key hash>.json` | `runs/<id>/` | `tables/`, `documents/` for
//! people | `tmp/`. Objects and records are written aside and moved into place, then made durable in groups; a crash leaves nothing
//! visible by half, and what a power cut tears is told by its hash.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::{error, units};
use calib_raw as raw;

pub mod actions;
mod check;
mod disk;
pub mod frame;
pub mod key;
mod notes;
mod reader;
mod remote;
pub mod runs;
#[cfg(feature = "s3")]
mod s3;
pub mod schema;
mod verify;
pub mod writer;

pub use actions::{Account, ActionRecord, Lookup, PendingTable, Published};
pub use key::{ActionId, FileHash, FileKey, KEY_FORMAT, ReadKey, StageKey, TableHash, TableRef};
pub use reader::{Loose, PublishedTable, read_table};
pub use reader::{file_notes, table_of_bytes};
pub use runs::{Link, Run, Sealed};
pub use verify::{Sweep, Verification};
pub use writer::{FinishedFile, TableWriter};

use crate::error::{Error, Result};
pub use disk::Claim;
use disk::{Durability, Workspace, entries, make_dir, put_if_absent, sync_dir};
pub use remote::Bucket;
use remote::Remote;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The layout described above.
const STORE_FORMAT: u32 = 1;

#[derive(Serialize, Deserialize)]
struct StoreMarker {
    calib_store: u32,
}

/// A folder of tables and the record of how they came about; alone, or before a bucket that many machines share.
#[derive(Debug)]
pub struct Store {
    root: PathBuf,
    remote: Option<Remote>,
    /// Opened with the first write, so that looking leaves no trace.
    workspace: Mutex<Option<Arc<Workspace>>>,
    durability: Durability,
    /// What this process knows of runs.
    runs: Mutex<KnownRuns>,
}

/// Runs that this process has seen or made: among the thousands of a fleet nobody looks through all for every robot.
#[derive(Debug, Default)]
struct KnownRuns {
    last: Option<String>,
    ended: Option<Link>,
}

impl Store {
    /// Opens a store, or a place where one will be: nothing is written before the first publish or run.
    pub fn open(root: impl Into<PathBuf>) -> Result<Self> {
        let root = root.into();
        let path = root.join("format.json");
        if !has_format(&path)?
            && let Err(occupied) = check_vacant(&root)
            // Another process may have begun it between the two.
            && !has_format(&path)?
        {
            return Err(occupied);
        }
        Ok(Self {
            root,
            remote: None,
            workspace: Mutex::new(None),
            durability: Durability::default(),
            runs: Mutex::default(),
        })
    }

    /// Its folder; of a bucket, that of what was fetched.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A writer for a table that does not fit into memory.
    pub fn writer(&self, kind: &str) -> Result<TableWriter> {
        Ok(TableWriter::new(schema::of(kind)?, self.workspace()?))
    }

    /// The folder for unfinished files; the first call makes the store.
    fn workspace(&self) -> Result<Arc<Workspace>> {
        let mut slot = self
            .workspace
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if let Some(workspace) = &*slot {
            return Ok(workspace.clone());
        }
        make_dir(&self.root)?;
        let workspace = Arc::new(Workspace::open(&self.root.join("tmp"))?);
        let path = self.root.join("format.json");
        if !path.exists() {
            let aside = workspace.write_synced(&format_text()?)?;
            put_if_absent(&aside, &path)?;
            sync_dir(&self.root)?;
            let _ = fs::remove_file(&aside);
        }
        *slot = Some(workspace.clone());
        Ok(workspace)
    }
}

fn format_text() -> Result<Vec<u8>> {
    serde_json::to_vec(&StoreMarker {
        calib_store: STORE_FORMAT,
    })
    .map_err(|e| Error::Bug(e.to_string()))
}

/// Whether there is a format file; fails where it is not that of a store of this calib.
fn has_format(path: &Path) -> Result<bool> {
    disk::read(path)?.map_or(Ok(false), |bytes| check_format(path, &bytes).map(|()| true))
}

fn check_format(path: &Path, bytes: &[u8]) -> Result<()> {
    let place = path.display().to_string();
    match serde_json::from_slice::<StoreMarker>(bytes) {
        Ok(format) if format.calib_store == STORE_FORMAT => Ok(()),
        Ok(format) => Err(Error::spec(
            place,
            format!(
                "the store was written by a newer calib (format {}, this one knows {STORE_FORMAT}): use that calib, or another store with --store DIR",
                format.calib_store
            ),
        )),
        Err(e) => Err(Error::store(
            place,
            format!(
                "not the format file of a calib store ({e}); restore it: {{\"calib_store\": {STORE_FORMAT}}}"
            ),
        )),
    }
}

/// A store may be begun in a folder that does not exist, is empty, or holds only the beginning of one.
fn check_vacant(root: &Path) -> Result<()> {
    let found = entries(root)?;
    let mut names = found.iter().filter_map(|path| path.file_name());
    names.find(|name| *name != "tmp").map_or(Ok(()), |name| {
        let message = format!(
            "not a calib store (no format.json, but `{}`); --store takes a store, or a new or empty folder",
            name.to_string_lossy()
        );
        Err(Error::spec(root.display().to_string(), message))
    })
}
