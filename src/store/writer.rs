//! Tables to Parquet files: chunks in, one file out, in bounded memory and with bytes that do not depend on the chunks.

use super::check;
use super::disk::{Workspace, refused};
use super::frame::Frame;
use super::key::{ContentHasher, FileHash, TableRef};
use super::schema::TableSchema;
use crate::error::{Error, Result};
use arrow::array::{Array, ArrayRef, AsArray, RecordBatch};
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, Float64Type, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, SortingColumn};
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;
use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// Keys of a file's metadata: the table's `name/version`, the units of its columns as JSON, and the hash of its content.
pub(super) const SCHEMA: &str = "calib.schema";
pub(super) const UNITS: &str = "calib.units";
pub(super) const CONTENT_HASH: &str = "calib.table_hash";

/// Rows of a row group: a few MB of a recording, so that readers can skip and writers stay small.
const GROUP_ROWS: usize = 1 << 16;
/// Tables below this are packed by snappy: making ready a zstd state for every column costs more than what it saves on some kB.
const SMALL_ROWS: u64 = 4096;

/// Writes one table chunk by chunk; keys ascend within and across chunks. A large one is encoded by a thread of its own, which falls
/// behind by some chunks at most.
pub struct TableWriter {
    schema: &'static TableSchema,
    path: PathBuf,
    workspace: Arc<Workspace>,
    rows: u64,
    /// Until the table is large.
    open: Option<Box<Open>>,
    aside: Option<EncodingThread>,
}

/// Encodes the chunks that it is sent.
struct EncodingThread {
    chunks: Option<SyncSender<RecordBatch>>,
    thread: Option<JoinHandle<Result<Box<Open>>>>,
}

/// A table's finished file, not yet published. Dropped, it leaves nothing.
#[derive(Debug)]
pub struct FinishedFile {
    table: TableRef,
    path: PathBuf,
    written: Option<File>,
    _workspace: Arc<Workspace>,
}

struct Open {
    schema: &'static TableSchema,
    path: PathBuf,
    /// Made into a writer with the first row group, when it is known whether the table is small.
    file: Option<File>,
    writer: Option<ArrowWriter<HashingFile>>,
    arrow_schema: SchemaRef,
    content: ContentHasher,
    waiting: Vec<RecordBatch>,
    last: Option<RecordBatch>,
    rows: u64,
}

impl TableWriter {
    pub(super) fn new(schema: &'static TableSchema, workspace: Arc<Workspace>) -> Self {
        Self {
            schema,
            path: workspace.fresh(),
            workspace,
            rows: 0,
            open: None,
            aside: None,
        }
    }

    /// Appends a chunk; a table without rows still needs one empty chunk. May fail for a chunk before.
    pub fn push(&mut self, chunk: &Frame) -> Result<()> {
        if chunk.kind() != self.schema.name {
            return Err(Error::Bug(format!(
                "a chunk of table {} for a table of {}",
                chunk.kind(),
                self.schema.name
            )));
        }
        if self.rows == 0 && self.open.is_none() && self.aside.is_none() {
            self.open = Some(Box::new(Open::new(self.schema, chunk, &self.path)?));
        }
        self.rows += chunk.rows() as u64;
        if self.rows >= GROUP_ROWS as u64 {
            self.aside = self
                .aside
                .take()
                .or(self.open.take().map(EncodingThread::new));
        }
        let pushed = match (&mut self.open, &mut self.aside) {
            (Some(open), _) => open.push(chunk.batch()),
            (None, Some(aside)) => aside.push(chunk.batch()),
            (None, None) => Err(Error::Bug("a table that failed before".into())),
        };
        // What lacks a chunk is never finished.
        if pushed.is_err() {
            (self.open, self.aside) = (None, None);
        }
        pushed
    }

    /// Closes the file.
    pub fn finish(self) -> Result<FinishedFile> {
        let without = || {
            let table = &self.schema.name;
            Error::Bug(format!("table {table}: finished without a chunk"))
        };
        let open = match self.aside {
            Some(mut aside) => aside.join()?,
            None => self.open.ok_or_else(without)?,
        };
        let (table, written) = open.finish()?;
        Ok(FinishedFile {
            table,
            path: self.path,
            written: Some(written),
            _workspace: self.workspace,
        })
    }
}

impl EncodingThread {
    fn new(mut open: Box<Open>) -> Self {
        let (chunks, taken) = sync_channel::<RecordBatch>(1);
        let encode = move || {
            let mut chunks = taken.into_iter();
            chunks
                .try_for_each(|chunk| open.push(&chunk))
                .map(|()| open)
        };
        Self {
            chunks: Some(chunks),
            thread: Some(std::thread::spawn(encode)),
        }
    }

    fn push(&mut self, chunk: &RecordBatch) -> Result<()> {
        let chunks = self.chunks.as_ref();
        match chunks.map(|chunks| chunks.send(chunk.clone())) {
            Some(Ok(())) => Ok(()),
            // It ended before its time.
            _ => self.join().map(drop),
        }
    }

    fn join(&mut self) -> Result<Box<Open>> {
        self.chunks = None;
        let thread = self.thread.take();
        let thread = thread.ok_or_else(|| Error::Bug("a table that failed before".into()))?;
        thread
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl Drop for EncodingThread {
    /// A table that is given up leaves no thread behind.
    fn drop(&mut self) {
        self.chunks = None;
        self.thread.take().map(JoinHandle::join);
    }
}

impl FinishedFile {
    /// What a record says of the table.
    pub fn table(&self) -> &TableRef {
        &self.table
    }
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
    /// The handle through which the file can be made durable.
    pub(super) fn written(&mut self) -> Option<File> {
        self.written.take()
    }
}

impl Drop for FinishedFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

impl Open {
    fn new(schema: &'static TableSchema, chunk: &Frame, path: &Path) -> Result<Self> {
        let file = File::create_new(path).map_err(|e| refused(path, "write", &e))?;
        Ok(Self {
            schema,
            path: path.to_path_buf(),
            file: Some(file),
            writer: None,
            arrow_schema: chunk.arrow_schema(),
            content: ContentHasher::new(&schema.name, schema.version.major),
            waiting: Vec::new(),
            last: None,
            rows: 0,
        })
    }

    fn writer(&mut self, first: Option<&RecordBatch>) -> Result<&mut ArrowWriter<HashingFile>> {
        if let Some(file) = self.file.take() {
            let capacity = if self.rows < SMALL_ROWS {
                1 << 14
            } else {
                1 << 18
            };
            let sink = HashingFile {
                file: BufWriter::with_capacity(capacity, file),
                hasher: blake3::Hasher::new(),
                bytes: 0,
            };
            let properties = properties(
                self.schema,
                &self.arrow_schema,
                first.filter(|_| self.rows >= SMALL_ROWS),
            )?;
            let writer = ArrowWriter::try_new(sink, self.arrow_schema.clone(), Some(properties));
            self.writer = Some(writer.map_err(|e| parquet_refused(&self.path, e))?);
        }
        self.writer
            .as_mut()
            .ok_or_else(|| Error::Bug(format!("table {}: no file to write to", self.schema.name)))
    }

    fn push(&mut self, batch: &RecordBatch) -> Result<()> {
        let schema = self.schema;
        if batch.schema_ref() != &self.arrow_schema {
            return Err(Error::Bug(format!(
                "table {}: chunks with different columns",
                schema.name
            )));
        }
        self.content.push(batch);
        if batch.num_rows() == 0 {
            return Ok(());
        }
        if let Some(last) = &self.last
            && !check::compare_keys(schema, last, batch)?(0, 0).is_lt()
        {
            let (before, after) = (
                check::key_of(schema, last, 0),
                check::key_of(schema, batch, 0),
            );
            return Err(Error::Bug(format!(
                "table {}: key {after} after {before}; keys ascend across chunks",
                schema.name
            )));
        }
        self.last = Some(batch.slice(batch.num_rows() - 1, 1));
        self.rows += batch.num_rows() as u64;
        self.waiting.push(batch.clone());
        let waiting: usize = self.waiting.iter().map(RecordBatch::num_rows).sum();
        if waiting >= GROUP_ROWS {
            self.write_groups()
        } else {
            Ok(())
        }
    }

    /// Writes whole row groups from what is waiting, so that their borders do not depend on the chunks.
    fn write_groups(&mut self) -> Result<()> {
        let all = self.waiting()?;
        let whole = all.num_rows() / GROUP_ROWS * GROUP_ROWS;
        for start in (0..whole).step_by(GROUP_ROWS) {
            self.write(&all.slice(start, GROUP_ROWS))?;
        }
        let remainder = all.slice(whole, all.num_rows() - whole);
        self.waiting = if remainder.num_rows() > 0 {
            vec![remainder]
        } else {
            Vec::new()
        };
        Ok(())
    }

    /// What is waiting, as one batch.
    fn waiting(&self) -> Result<RecordBatch> {
        match self.waiting.as_slice() {
            [batch] => Ok(batch.clone()),
            all => concat_batches(&self.arrow_schema, all).map_err(|e| Error::Bug(e.to_string())),
        }
    }

    fn write(&mut self, batch: &RecordBatch) -> Result<()> {
        self.writer(Some(batch))?
            .write(batch)
            .map_err(|e| parquet_refused(&self.path, e))
    }

    fn finish(mut self) -> Result<(TableRef, File)> {
        if !self.waiting.is_empty() {
            let remainder = self.waiting()?;
            self.write(&remainder)?;
        }
        self.writer(None)?;
        let (schema, path) = (self.schema, &self.path);
        let Some(mut writer) = self.writer else {
            return Err(Error::Bug(format!("table {}: no writer", schema.name)));
        };
        let table_hash = self.content.finish();
        writer
            .append_key_value_metadata(KeyValue::new(CONTENT_HASH.into(), table_hash.to_string()));
        // Not `into_inner`, which hides what the disk said of the last bytes.
        writer.finish().map_err(|e| parquet_refused(path, e))?;
        let (file, file_hash, bytes) = writer
            .inner_mut()
            .close()
            .map_err(|e| refused(path, "write", &e))?;
        Ok((
            TableRef {
                schema: schema.id(),
                table_hash,
                file_hash,
                rows: self.rows,
                bytes,
            },
            file,
        ))
    }
}

/// Everything that shapes the bytes, so that equal tables make equal files. Schema, key and units are plain key-values besides,
/// for readers that do not see Arrow's field metadata. Of a large table the first row group is known.
fn properties(
    schema: &TableSchema,
    arrow_schema: &SchemaRef,
    large: Option<&RecordBatch>,
) -> Result<WriterProperties> {
    let index = |name: &String| {
        arrow_schema.index_of(name).map(|i| SortingColumn {
            column_idx: i as i32,
            descending: false,
            nulls_first: false,
        })
    };
    let sorting = schema
        .sort
        .iter()
        .map(index)
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| Error::Bug(e.to_string()))?;
    let unit = |field: &Arc<arrow::datatypes::Field>| {
        field
            .metadata()
            .get("unit")
            .map(|unit| (field.name().clone(), unit.clone().into()))
    };
    let units: serde_json::Map<String, serde_json::Value> =
        arrow_schema.fields().iter().filter_map(unit).collect();
    let key_values = [
        (SCHEMA, schema.id()),
        ("calib.description", schema.description.clone()),
        ("calib.primary_key", schema.primary_key.join(",")),
        (UNITS, super::key::canonical(&units.into())),
    ];
    let zstd = ZstdLevel::try_new(3).map_err(|e| Error::Bug(e.to_string()))?;
    let compression = match large {
        Some(_) => Compression::ZSTD(zstd),
        None => Compression::SNAPPY,
    };
    let mut properties = WriterProperties::builder()
        .set_compression(compression)
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_sorting_columns(Some(sorting))
        .set_key_value_metadata(Some(
            key_values
                .map(|(key, value)| KeyValue::new(key.into(), value))
                .into(),
        ))
        .set_dictionary_enabled(false);
    // Names of sets, steps and files repeat. Of a large table measured numbers and names of points do not: a dictionary of such names is a
    // second column, and of such numbers zstd, most of the work of writing them, saves a tenth.
    for (index, field) in arrow_schema.fields().iter().enumerate() {
        let (path, repeats) = (
            ColumnPath::from(field.name().as_str()),
            large.is_none_or(|batch| repeats(batch.column(index))),
        );
        match field.data_type() {
            DataType::Utf8 => properties = properties.set_column_dictionary_enabled(path, repeats),
            DataType::Float64 if !repeats => {
                properties = properties.set_column_compression(path, Compression::UNCOMPRESSED);
            }
            _ => {}
        }
    }
    Ok(properties.build())
}

/// Whether a column's first cells have less than half as many values.
fn repeats(column: &ArrayRef) -> bool {
    let first = column.slice(0, column.len().min(SMALL_ROWS as usize));
    let different = match first.data_type() {
        DataType::Utf8 => first
            .as_string::<i32>()
            .iter()
            .collect::<HashSet<_>>()
            .len(),
        DataType::Float64 => {
            let cells = first.as_primitive::<Float64Type>().iter();
            let bits = cells.map(|cell| cell.map(f64::to_bits));
            bits.collect::<HashSet<_>>().len()
        }
        _ => 0,
    };
    2 * different < first.len()
}

/// The disk's own words, where there are any.
pub(super) fn parquet_refused(path: &Path, error: ParquetError) -> Error {
    if let ParquetError::External(source) = &error
        && let Some(io) = source.downcast_ref::<io::Error>()
    {
        return refused(path, "write", io);
    }
    Error::store(path.display().to_string(), format!("cannot write: {error}"))
}

/// A file whose bytes are hashed on their way.
struct HashingFile {
    file: BufWriter<File>,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl Write for HashingFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let n = self.file.write(bytes)?;
        self.hasher.update(&bytes[..n]);
        self.bytes += n as u64;
        Ok(n)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl HashingFile {
    fn close(&mut self) -> io::Result<(File, FileHash, u64)> {
        self.file.flush()?;
        Ok((
            self.file.get_ref().try_clone()?,
            FileHash::of(&self.hasher),
            self.bytes,
        ))
    }
}
