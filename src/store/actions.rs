//! Action records, the commit point: which tables a stage made from which key. Data first, then the record, put if absent.

use super::Store;
use super::disk::{make_read_only, place};
use super::frame::Frame;
use super::key::{ActionId, StageKey, TableHash, TableRef, same_bytes};
use super::notes::{seal, unseal};
use super::reader::{self, PublishedTable};
use super::writer::{FinishedFile, TableWriter};
use crate::error::{Error, Result, counted};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Bumped when older records can no longer be understood: all stages run again.
const RECORD_FORMAT: u32 = 1;

/// What a stage made, and how it went.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ActionRecord {
    /// Version of the layout of records.
    pub record_format: u32,
    /// Hash of the key.
    pub id: ActionId,
    /// What the tables depend on.
    pub key: StageKey,
    /// By port.
    pub tables: BTreeMap<String, TableRef>,
    /// How it went.
    pub account: Account,
}

/// How a stage's run went: what it told the person, and what it cost.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Account {
    /// The run that executed the stage.
    pub run: String,
    /// RFC 3339.
    pub started: String,
    /// RFC 3339, UTC.
    pub ended: String,
    /// From start to end.
    pub wall_seconds: f64,
    /// Processor time of all threads, where known.
    pub cpu_seconds: Option<f64>,
    /// What the stage told.
    pub notes: Vec<String>,
    /// What the stage warned of.
    pub warnings: Vec<String>,
}

/// The answer to "is this already done?".
#[derive(Debug, Clone, PartialEq)]
pub enum Lookup {
    /// The record is there.
    Done(Box<ActionRecord>),
    /// Nobody has done it.
    Absent,
    /// There is a record, but it or one of its tables is damaged: as good as absent. Why, in a sentence.
    Damaged(String),
}

/// A table on its way into the store.
#[derive(Debug)]
pub enum PendingTable {
    /// Columns in memory.
    Frame(Frame),
    /// A file that is written already.
    File(FinishedFile),
}

/// The record that stands after publishing.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// The record that stands: ours, or that of who was first.
    pub record: ActionRecord,
    /// Set where somebody published other content under the same key: the stage is not deterministic.
    pub conflict: Option<String>,
}

impl Store {
    fn record_path(&self, id: &ActionId) -> PathBuf {
        self.root()
            .join("actions")
            .join(&id.as_str()[..2])
            .join(format!("{id}.json"))
    }

    /// The file of a published table.
    pub fn object_path(&self, table: &TableRef) -> PathBuf {
        let name = table.file_hash.as_str();
        self.root()
            .join("objects")
            .join(name.get(..2).unwrap_or("00"))
            .join(format!("{name}.parquet"))
    }

    /// The file of a published table, which of a store in a bucket is fetched first; fails where the bucket does not hold it whole.
    pub fn object(&self, table: &TableRef) -> Result<PathBuf> {
        let path = self.object_path(table);
        match path.exists() || !self.in_bucket() || self.obtain(table, &path)? {
            true => Ok(path),
            false => Err(Error::store(
                self.label(&path),
                "is missing from the bucket, or its bytes are not those that were published; calib run makes it anew",
            )),
        }
    }

    /// Looks a stage up: done only if the record is whole and all its tables are there, byte for byte.
    pub fn action(&self, key: &StageKey) -> Result<Lookup> {
        let path = self.record_path(&key.id());
        if !self.refresh(&path)? {
            return Ok(Lookup::Absent);
        }
        let Some(bytes) = super::disk::read(&path)? else {
            return Ok(Lookup::Absent);
        };
        let damaged = |why: String| {
            Ok(Lookup::Damaged(format!(
                "{}: {why}; the stage runs again",
                path.display()
            )))
        };
        if let Err(why) = unseal(&bytes) {
            return damaged(why.into());
        }
        let record: ActionRecord = match serde_json::from_slice(&bytes) {
            Ok(record) => record,
            Err(e) => return damaged(format!("not a whole action record ({e})")),
        };
        if record.record_format != RECORD_FORMAT || record.id != key.id() || &record.key != key {
            return damaged("the record is not of this key".into());
        }
        for (port, table) in &record.tables {
            let path = self.object_path(table);
            let length = fs::metadata(&path).map(|metadata| metadata.len());
            match length {
                // Read to its end: a stage that is cached must not stand on a table that rotted.
                Ok(length) if length == table.bytes && same_bytes(&path, table) => (),
                _ if self.obtain(table, &path)? => (),
                Ok(length) if length == table.bytes => {
                    return damaged(format!("table {port} is not what was published"));
                }
                Ok(length) => {
                    return damaged(format!(
                        "table {port} has {} instead of {}",
                        counted(length, "byte"),
                        table.bytes
                    ));
                }
                Err(e) => return damaged(format!("table {port}: {e}")),
            }
        }
        Ok(Lookup::Done(Box::new(record)))
    }

    /// Commits what a stage made: objects first, then the record. If a whole record is there already, that one stands. All can be
    /// seen at once and is durable after the next `sync`.
    pub fn publish(
        &self,
        key: &StageKey,
        products: Vec<(String, PendingTable)>,
        account: Account,
    ) -> Result<Published> {
        let mut tables = BTreeMap::new();
        for (port, product) in products {
            let file = match product {
                PendingTable::Frame(frame) => self.write_frame(&frame)?,
                PendingTable::File(file) => file,
            };
            let table = self.put_object(file)?;
            if tables.insert(port.clone(), table).is_some() {
                return Err(Error::Bug(format!(
                    "stage {}: port {port} twice",
                    key.stage
                )));
            }
        }
        let record = ActionRecord {
            record_format: RECORD_FORMAT,
            id: key.id(),
            key: key.clone(),
            tables,
            account,
        };
        let path = self.record_path(&record.id);
        let text = seal(&record)?;
        if !self.put_once(&path, &text)? {
            if let Lookup::Done(standing) = self.action(key)? {
                return Ok(Published {
                    conflict: conflict(&standing, &record),
                    record: *standing,
                });
            }
            self.put(&path, &text)?;
        }
        Ok(Published {
            record,
            conflict: None,
        })
    }

    /// Reads a published table.
    pub fn load(&self, table: &TableRef) -> Result<Frame> {
        reader::load(&self.object(table)?, table)
    }

    /// The same, to be read chunk by chunk.
    pub fn published(&self, table: &TableRef) -> Result<PublishedTable> {
        PublishedTable::open(self.object(table)?, table.clone())
    }

    /// Whether the file of a published table is there, byte for byte.
    pub fn is_whole(&self, table: &TableRef) -> Result<bool> {
        Ok(same_bytes(&self.object(table)?, table))
    }

    fn write_frame(&self, frame: &Frame) -> Result<FinishedFile> {
        let mut writer = TableWriter::new(frame.schema(), self.workspace()?);
        writer.push(frame)?;
        writer.finish()
    }

    /// Moves a finished file to its place among the objects; an equal one that is there already stands.
    fn put_object(&self, mut file: FinishedFile) -> Result<TableRef> {
        let table = file.table().clone();
        let path = self.object_path(&table);
        self.give(file.path(), &path)?;
        if !same_bytes(&path, &table) {
            make_read_only(file.path())?;
            place(file.path(), &path)?;
            file.written()
                .map_or(Ok(()), |written| self.owe(&path, written))?;
        } else if let Ok(standing) = fs::File::open(&path) {
            // Whoever put it there may not have made it durable yet.
            self.owe(&path, standing)?;
        }
        Ok(table)
    }
}

fn conflict(standing: &ActionRecord, fresh: &ActionRecord) -> Option<String> {
    let ports = |record: &ActionRecord| -> BTreeMap<String, TableHash> {
        record
            .tables
            .iter()
            .map(|(port, table)| (port.clone(), table.table_hash.clone()))
            .collect()
    };
    let (old, new) = (ports(standing), ports(fresh));
    if old == new {
        return None;
    }
    let differing: Vec<&str> = new
        .iter()
        .filter(|(port, hash)| old.get(*port) != Some(hash))
        .map(|(port, _)| port.as_str())
        .collect();
    Some(format!(
        "stage {} is not deterministic: the same key gave other content before in {}; the earlier tables stand (action {})",
        fresh.key.stage,
        differing.join(", "),
        standing.id
    ))
}
