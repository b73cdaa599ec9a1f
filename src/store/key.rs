//! What a stage's result depends on, as a record that a person can read; its hash names the action.
//!
//! Content only: never a path, a date, a host, a thread count or calib's own version.
//!
//! The identity of a table: a hash of its logical content, whatever the chunks and whoever wrote the Parquet file. One blake3 stream per
//! column over its cells (a presence byte, then 8 little-endian bytes, 1 byte, or length and text), then one hash over kind, major version,
//! row count and every column's name, type, unit and stream.

use super::frame::Frame;
use arrow::array::{Array, ArrayRef, ArrowPrimitiveType, AsArray, PrimitiveArray, RecordBatch};
use arrow::datatypes::{DataType, Float64Type, Int64Type};
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
    pub stage: Option<String>,
    /// Hash of its content.
    pub table: TableHash,
}

/// A raw input file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FileKey {
    /// Its name without folders, which tables of rejected rows show.
    pub name: String,
    /// Hash of its bytes.
    pub content: FileHash,
}

/// Declares hashes by blake3, as 64 hex digits.
macro_rules! hashes {
    ($( $(#[$doc:meta])* $name:ident, )+) => { $(
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(transparent)]
        pub struct $name(String);

        impl $name {
            pub(super) fn of(hasher: &blake3::Hasher) -> Self {
                Self(hasher.finalize().to_hex().to_string())
            }
            /// Hexadecimal.
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    )+ };
}

hashes! {
    /// The hash of a [`StageKey`].
    ActionId,
    /// Hash of a file's bytes.
    FileHash,
    /// Hash of a table's logical content.
    TableHash,
}

impl StageKey {
    /// The hash of the key.
    pub fn id(&self) -> ActionId {
        let value = serde_json::to_value(self).expect("a key is plain data");
        ActionId::of(blake3::Hasher::new().update(canonical(&value).as_bytes()))
    }
}

impl FileHash {
    /// Reads to the end.
    pub fn of_reader(mut reader: impl Read) -> std::io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        let mut block = vec![0; 1 << 18];
        loop {
            match reader.read(&mut block)? {
                0 => return Ok(Self::of(&hasher)),
                n => hasher.update(&block[..n]),
            };
        }
    }
}

/// JSON without white space, keys in order, floats as their shortest round trip: one text per value.
pub fn canonical(value: &Value) -> String {
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
    pub schema: String,
    /// Identity of the content.
    pub table_hash: TableHash,
    /// Name of the object that holds it.
    pub file_hash: FileHash,
    /// How many.
    pub rows: u64,
    /// Size of the file, bytes.
    pub bytes: u64,
}

/// Whether a file is the one that was published, byte for byte.
pub(super) fn same_bytes(path: &Path, table: &TableRef) -> bool {
    File::open(path)
        .and_then(FileHash::of_reader)
        .is_ok_and(|found| found == table.file_hash)
}

impl Frame {
    /// The identity of this table.
    pub fn table_hash(&self) -> TableHash {
        let mut hasher = ContentHasher::new(self.kind(), self.schema().version.major);
        hasher.push(self.batch());
        hasher.finish()
    }
}

/// The identity of columns as a file of this kind and major version has them; none where one is of a type that no table has.
pub(super) fn hash_of_columns(kind: &str, major: u32, batch: &RecordBatch) -> Option<TableHash> {
    let known = [
        DataType::Float64,
        DataType::Int64,
        DataType::Boolean,
        DataType::Utf8,
    ];
    let fields = batch.schema_ref().fields();
    fields
        .iter()
        .all(|field| known.contains(field.data_type()))
        .then(|| {
            let mut hasher = ContentHasher::new(kind, major);
            hasher.push(batch);
            hasher.finish()
        })
}

/// Hashes a table chunk by chunk; every chunk has the same columns.
pub(super) struct ContentHasher {
    kind: String,
    major: u32,
    rows: u64,
    columns: Vec<(String, blake3::Hasher)>,
}

impl ContentHasher {
    pub(super) fn new(kind: &str, major: u32) -> Self {
        Self {
            kind: kind.into(),
            major,
            rows: 0,
            columns: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, chunk: &RecordBatch) {
        if self.columns.is_empty() {
            let header = |field: &std::sync::Arc<arrow::datatypes::Field>| {
                let unit = field.metadata().get("unit").map_or("", String::as_str);
                format!("{}\0{}\0{unit}", field.name(), field.data_type())
            };
            self.columns = chunk
                .schema_ref()
                .fields()
                .iter()
                .map(|field| (header(field), blake3::Hasher::new()))
                .collect();
        }
        assert_eq!(
            self.columns.len(),
            chunk.num_columns(),
            "chunks of one table have the same columns"
        );
        self.rows += chunk.num_rows() as u64;
        for ((_, hasher), array) in self.columns.iter_mut().zip(chunk.columns()) {
            hash_cells(hasher, array);
        }
    }

    pub(super) fn finish(self) -> TableHash {
        let mut whole = blake3::Hasher::new();
        let mut text = |text: &str| {
            whole.update(&(text.len() as u64).to_le_bytes());
            whole.update(text.as_bytes());
        };
        text("calib table 1");
        text(&self.kind);
        text(&self.major.to_string());
        text(&self.rows.to_string());
        for (header, hasher) in self.columns {
            text(&header);
            text(&hasher.finalize().to_hex());
        }
        TableHash::of(&whole)
    }
}

/// Bytes that are hashed at a time; large enough for blake3 to be fast.
const BLOCK: usize = 1 << 16;

/// Feeds the cells of a column, presence first.
fn hash_cells(hasher: &mut blake3::Hasher, array: &ArrayRef) {
    match array.data_type() {
        DataType::Float64 => numbers(hasher, array.as_primitive::<Float64Type>(), |value| {
            value.to_bits().to_le_bytes()
        }),
        DataType::Int64 => numbers(hasher, array.as_primitive::<Int64Type>(), i64::to_le_bytes),
        DataType::Boolean => feed(hasher, array.as_boolean().iter(), |block, value| {
            block.push(u8::from(value))
        }),
        DataType::Utf8 => feed(hasher, array.as_string::<i32>().iter(), |block, value| {
            block.extend_from_slice(&(value.len() as u64).to_le_bytes());
            block.extend_from_slice(value.as_bytes());
        }),
        other => unreachable!("no schema has a column of type {other}"),
    }
}

fn numbers<T: ArrowPrimitiveType>(
    hasher: &mut blake3::Hasher,
    array: &PrimitiveArray<T>,
    bytes: fn(T::Native) -> [u8; 8],
) {
    if array.null_count() > 0 {
        return feed(hasher, array.iter(), |block, value| {
            block.extend_from_slice(&bytes(value))
        });
    }
    let mut block = vec![[1; 9]; (BLOCK / 9).min(array.len())];
    for values in array.values().chunks(block.len().max(1)) {
        block
            .iter_mut()
            .zip(values)
            .for_each(|(cell, value)| cell[1..].copy_from_slice(&bytes(*value)));
        hasher.update(block[..values.len()].as_flattened());
    }
}

fn feed<T>(
    hasher: &mut blake3::Hasher,
    cells: impl Iterator<Item = Option<T>>,
    encode: impl Fn(&mut Vec<u8>, T),
) {
    let mut block = Vec::with_capacity(BLOCK + 64);
    for cell in cells {
        block.push(u8::from(cell.is_some()));
        if let Some(value) = cell {
            encode(&mut block, value);
        }
        if block.len() >= BLOCK {
            hasher.update(&block);
            block.clear();
        }
    }
    hasher.update(&block);
}
