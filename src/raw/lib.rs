//! Files that others made: opened only where they are regular, and decoded so that a decoder that gives up is a fault of the file.
//!
//! Bytes become text (`text`), text (`delimited`), sheets (`workbook`), columns (`columns`) and topics of recordings (`bag`) become the same
//! records (`record`), and cells numbers (`number`): all that reads tables of others reads them here.
//!
//! A pipe or a device may never end, and may wait for a writer for ever. The decoder of Parquet panics on some damaged files.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_foundation::error;

mod arrays;
mod bag;
mod columns;
mod delimited;
mod json;
mod number;
mod record;
mod text;
mod workbook;

pub use bag::{BagContent, BagRows, BagTopic, bag_content, is_bag};
pub use columns::{ColumnRows, has_columns};
pub use delimited::{Delimiter, TextLayout, TextRows, fields, unquoted_text};
pub use json::{JsonRows, is_json};
pub use number::{DecimalMark, NumberFault, number, number_of_any_mark};
pub use record::{InputSource, Record, RecordFault, RecordReader, failed, source};
pub use text::{decoded_text, is_utf16, not_read, shown, without_utf16};
pub use workbook::{Workbook, is_workbook};

use arrow::array::{RecordBatch, RecordBatchReader};
use arrow::datatypes::SchemaRef;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::file::reader::ChunkReader;
use std::fs::{self, File, FileType};
use std::io::{self, ErrorKind, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// What a file's name ends in, in small letters, without the dot; nothing where it has none.
pub fn ending(path: &Path) -> String {
    path.extension()
        .and_then(|ending| ending.to_str())
        .unwrap_or_default()
        .to_ascii_lowercase()
}

/// Whether two names are of one file that is there.
pub fn same_file(a: &Path, b: &Path) -> bool {
    let found = |path: &Path| path.canonicalize().ok();
    found(a).is_some() && found(a) == found(b)
}

/// Opens a regular file; a folder, a pipe or a device is refused.
pub fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    if kind.is_file() {
        return File::open(path);
    }
    Err(io::Error::new(
        ErrorKind::InvalidInput,
        format!("{}, not a regular file", what(kind)),
    ))
}

/// The text of a regular file in UTF-8.
pub fn text(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// The bytes of a regular file.
pub fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(unix)]
fn what(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match kind {
        kind if kind.is_dir() => "is a folder",
        kind if kind.is_fifo() => "is a named pipe",
        kind if kind.is_socket() => "is a socket",
        _ => "is a device",
    }
}

#[cfg(not(unix))]
fn what(kind: FileType) -> &'static str {
    if kind.is_dir() {
        "is a folder"
    } else {
        "is a device"
    }
}

/// What a decoder gives; its panic is told in words.
pub fn decoded<T>(decode: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(decode)).map_err(|panic| {
        let text = panic
            .downcast_ref::<&str>()
            .copied()
            .or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        format!(
            "it is damaged, its decoder gives up ({})",
            text.unwrap_or("without a word")
        )
    })
}

/// Batches of rows; an error is what a person is told of a damaged file.
pub type Batches = Box<dyn Iterator<Item = Result<RecordBatch, String>> + Send>;

/// A file of columns, batch by batch; what is wrong with it comes in words, once.
pub struct BatchFile {
    /// Its columns.
    pub schema: SchemaRef,
    /// Rows, where the file says it.
    pub rows: Option<u64>,
    batches: Batches,
}

/// Opens Parquet from a file or from bytes, for batches of so many rows.
pub fn parquet(input: impl ChunkReader + 'static, batch: usize) -> Result<BatchFile, String> {
    let opened = decoded(|| {
        let builder = ParquetRecordBatchReaderBuilder::try_new(input)?;
        let rows = u64::try_from(builder.metadata().file_metadata().num_rows());
        let file = BatchFile::of(builder.with_batch_size(batch).build()?);
        let rows = Some(rows.unwrap_or_default());
        Ok(BatchFile { rows, ..file })
    });
    opened?.map_err(|error: parquet::errors::ParquetError| error.to_string())
}

impl Iterator for BatchFile {
    type Item = Result<RecordBatch, String>;

    fn next(&mut self) -> Option<Self::Item> {
        self.batches.next()
    }
}

impl BatchFile {
    /// A file that is being read.
    pub fn of(reader: impl RecordBatchReader + Send + 'static) -> Self {
        let schema = reader.schema();
        // A decoder that gave up is not asked again.
        let mut reader = Some(reader);
        let batches = std::iter::from_fn(move || {
            let batch = decoded(|| reader.as_mut()?.next());
            let batch = batch.map(|batch| Some(batch?.map_err(|error| error.to_string())));
            let batch = batch.unwrap_or_else(|message| Some(Err(message)));
            reader = reader.take().filter(|_| matches!(batch, Some(Ok(_))));
            batch
        });
        Self {
            schema,
            rows: None,
            batches: Box::new(batches),
        }
    }
    /// All rows as one batch.
    pub fn whole(mut self) -> Result<RecordBatch, String> {
        let batches = self.by_ref().collect::<Result<Vec<_>, String>>()?;
        arrow::compute::concat_batches(&self.schema, &batches).map_err(|error| error.to_string())
    }
}
