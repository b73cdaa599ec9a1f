//! What a stage's result depends on, as a record that a person can read; its hash names the action.
//!
//! Content only: never a path, a date, a host, a thread count or calib's own version.
//!
//! What a record says of a published table: enough to find its file and to know whether it is whole.

use super::content::TableHash;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bumped when the meaning of a key changes: all stages run again.
pub const KEY_FORMAT: u32 = 1;

/// Everything that the outputs of a stage depend on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageKey {
    /// Format of this key.
    pub key_format: u32,
    /// The stage's id: the `step` of its tables.
    pub id: String,
    /// Its kind.
    pub stage: String,
    /// Version of its algorithm.
    pub implementation: u32,
    /// Resolved settings, defaults filled in.
    pub settings: Value,
    /// Input tables by port.
    pub reads: BTreeMap<String, Vec<ReadKey>>,
    /// Raw input files, by their place in the settings.
    pub files: BTreeMap<String, FileKey>,
    /// Output schemas (`name/version`) by port.
    pub schemas: BTreeMap<String, String>,
    /// The seed of the stage.
    pub seed: u64,
}

/// An input table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReadKey {
    /// The stage that wrote it, where the port takes several and the reader sees whose they are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) stage: Option<String>,
    /// Hash of its content.
    pub(crate) table: TableHash,
}

/// A raw input file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FileKey {
    /// Its name without folders, which tables of rejected rows show.
    pub(crate) name: String,
    /// Hash of its bytes.
    pub(crate) content: FileHash,
}

/// The hash of a [`StageKey`], as 64 hex digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ActionId(String);

/// blake3 of a file's bytes, as 64 hex digits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct FileHash(String);

impl StageKey {
    /// The hash of the key.
    pub fn id(&self) -> ActionId {
        let value = serde_json::to_value(self).expect("a key is plain data");
        ActionId(
            blake3::hash(canonical(&value).as_bytes())
                .to_hex()
                .to_string(),
        )
    }
}

impl ActionId {
    /// Hexadecimal.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for ActionId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FileHash {
    pub(super) fn of_hasher(hasher: &blake3::Hasher) -> Self {
        Self(hasher.finalize().to_hex().to_string())
    }
    /// Reads to the end.
    pub(crate) fn of_reader(mut reader: impl Read) -> std::io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        let mut block = vec![0; 1 << 18];
        loop {
            match reader.read(&mut block)? {
                0 => return Ok(Self::of_hasher(&hasher)),
                n => hasher.update(&block[..n]),
            };
        }
    }
    /// Hexadecimal.
    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for FileHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// JSON without white space, keys in order, floats as their shortest round trip: one text per value.
pub(crate) fn canonical(value: &Value) -> String {
    match value {
        Value::Object(map) => {
            let ordered: BTreeMap<&String, &Value> = map.iter().collect();
            let member = |(key, value): (&String, &Value)| {
                format!("{}:{}", Value::String(key.clone()), canonical(value))
            };
            format!(
                "{{{}}}",
                ordered
                    .into_iter()
                    .map(member)
                    .collect::<Vec<_>>()
                    .join(",")
            )
        }
        Value::Array(items) => format!(
            "[{}]",
            items.iter().map(canonical).collect::<Vec<_>>().join(",")
        ),
        plain => plain.to_string(),
    }
}

/// A published table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TableRef {
    /// `name/version`.
    pub(crate) schema: String,
    /// Identity of the content.
    pub table_hash: TableHash,
    /// Name of the object that holds it.
    pub(crate) file_hash: FileHash,
    /// How many.
    pub rows: u64,
    /// Size of the file, bytes.
    pub(crate) bytes: u64,
}

/// Whether a file is the one that was published, byte for byte.
pub(super) fn same_bytes(path: &Path, table: &TableRef) -> bool {
    File::open(path)
        .and_then(FileHash::of_reader)
        .is_ok_and(|found| found == table.file_hash)
}
