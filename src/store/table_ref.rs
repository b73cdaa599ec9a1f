//! What a record says of a published table: enough to find its file and to know whether it is whole.

use super::content::TableHash;
use super::key::FileHash;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::Path;

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
