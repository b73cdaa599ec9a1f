//! Tables to Parquet files: chunks in, one file out, in bounded memory and with bytes that do not depend on the chunks.

use arrow::array::RecordBatch;
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, SortingColumn};
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::check;
use super::content::ContentHasher;
use super::disk::refused;
use super::frame::Frame;
use super::key::FileHash;
use super::schema::TableSchema;
use super::table_ref::TableRef;
use super::workspace::Workspace;
use crate::error::{Error, Result};

/// Keys of a file's metadata: the table's `name/version`, the units of its columns as JSON, and the hash of its content.
pub(super) const SCHEMA: &str = "calib.schema";
pub(super) const UNITS: &str = "calib.units";
pub(super) const CONTENT_HASH: &str = "calib.table_hash";

/// Rows of a row group: a few MB of a recording, so that readers can skip and writers stay small.
const GROUP_ROWS: usize = 1 << 16;
/// Tables below this are packed by snappy: making ready a zstd state for every column costs more than what it saves on some kB.
const SMALL_ROWS: u64 = 4096;

/// Writes one table chunk by chunk; keys ascend within and across chunks.
pub struct TableWriter {
    schema: &'static TableSchema,
    path: PathBuf,
    workspace: Arc<Workspace>,
    open: Option<Open>,
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
        Self { schema, path: workspace.fresh(), workspace, open: None }
    }

    /// Appends a chunk; a table without rows still needs one empty chunk.
    pub fn push(&mut self, chunk: &Frame) -> Result<()> {
        if chunk.kind() != self.schema.name {
            return Err(Error::Bug(format!("a chunk of table {} for a table of {}", chunk.kind(), self.schema.name)));
        }
        if self.open.is_none() {
            self.open = Some(Open::new(self.schema, chunk, &self.path)?);
        }
        let Some(open) = &mut self.open else { return Ok(()) };
        open.push(self.schema, chunk, &self.path)
    }

    /// Written so far.
    pub fn rows(&self) -> u64 {
        self.open.as_ref().map_or(0, |open| open.rows)
    }

    /// Closes the file.
    pub fn finish(self) -> Result<FinishedFile> {
        let open = self.open.ok_or_else(|| Error::Bug(format!("table {}: finished without a chunk", self.schema.name)))?;
        let (table, written) = open.finish(self.schema, &self.path)?;
        Ok(FinishedFile { table, path: self.path, written: Some(written), _workspace: self.workspace })
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
        let (arrow_schema, content) = (chunk.arrow_schema(), ContentHasher::new(&schema.name, schema.version.major));
        Ok(Self { file: Some(file), writer: None, arrow_schema, content, waiting: Vec::new(), last: None, rows: 0 })
    }

    fn writer(&mut self, schema: &TableSchema, path: &Path) -> Result<&mut ArrowWriter<HashingFile>> {
        if let Some(file) = self.file.take() {
            let capacity = if self.rows < SMALL_ROWS { 1 << 14 } else { 1 << 18 };
            let sink = HashingFile { file: BufWriter::with_capacity(capacity, file), hasher: blake3::Hasher::new(), bytes: 0 };
            let properties = properties(schema, &self.arrow_schema, self.rows)?;
            let writer = ArrowWriter::try_new(sink, self.arrow_schema.clone(), Some(properties));
            self.writer = Some(writer.map_err(|e| parquet_refused(path, e))?);
        }
        self.writer.as_mut().ok_or_else(|| Error::Bug(format!("table {}: no file to write to", schema.name)))
    }

    fn push(&mut self, schema: &'static TableSchema, chunk: &Frame, path: &Path) -> Result<()> {
        if chunk.arrow_schema() != self.arrow_schema {
            return Err(Error::Bug(format!("table {}: chunks with different columns", schema.name)));
        }
        let batch = chunk.batch();
        self.content.push(batch);
        if batch.num_rows() == 0 {
            return Ok(());
        }
        if let Some(last) = &self.last
            && !check::compare_keys(schema, last, batch)?(0, 0).is_lt()
        {
            let (before, after) = (check::key_of(schema, last, 0), check::key_of(schema, batch, 0));
            return Err(Error::Bug(format!("table {}: key {after} after {before}; keys ascend across chunks", schema.name)));
        }
        self.last = Some(batch.slice(batch.num_rows() - 1, 1));
        self.rows += batch.num_rows() as u64;
        self.waiting.push(batch.clone());
        let waiting: usize = self.waiting.iter().map(RecordBatch::num_rows).sum();
        if waiting >= GROUP_ROWS { self.write_groups(schema, path) } else { Ok(()) }
    }

    /// Writes whole row groups from what is waiting, so that their borders do not depend on the chunks.
    fn write_groups(&mut self, schema: &TableSchema, path: &Path) -> Result<()> {
        let all = concat_batches(&self.arrow_schema, &self.waiting).map_err(|e| Error::Bug(e.to_string()))?;
        let whole = all.num_rows() / GROUP_ROWS * GROUP_ROWS;
        for start in (0..whole).step_by(GROUP_ROWS) {
            self.write(&all.slice(start, GROUP_ROWS), schema, path)?;
        }
        let rest = all.slice(whole, all.num_rows() - whole);
        self.waiting = if rest.num_rows() > 0 { vec![rest] } else { Vec::new() };
        Ok(())
    }

    fn write(&mut self, batch: &RecordBatch, schema: &TableSchema, path: &Path) -> Result<()> {
        self.writer(schema, path)?.write(batch).map_err(|e| parquet_refused(path, e))
    }

    fn finish(mut self, schema: &'static TableSchema, path: &Path) -> Result<(TableRef, File)> {
        if !self.waiting.is_empty() {
            let rest = concat_batches(&self.arrow_schema, &self.waiting).map_err(|e| Error::Bug(e.to_string()))?;
            self.write(&rest, schema, path)?;
        }
        self.writer(schema, path)?;
        let Some(mut writer) = self.writer else { return Err(Error::Bug(format!("table {}: no writer", schema.name))) };
        let table_hash = self.content.finish();
        writer.append_key_value_metadata(KeyValue::new(CONTENT_HASH.into(), table_hash.to_string()));
        // Not `into_inner`, which hides what the disk said of the last bytes.
        writer.finish().map_err(|e| parquet_refused(path, e))?;
        let (file, file_hash, bytes) = writer.inner_mut().close().map_err(|e| refused(path, "write", &e))?;
        Ok((TableRef { schema: schema.id(), table_hash, file_hash, rows: self.rows, bytes }, file))
    }
}

/// Everything that shapes the bytes, so that equal tables make equal files. Schema, key and units are plain key-values besides,
/// for readers that do not see Arrow's field metadata.
fn properties(schema: &TableSchema, arrow_schema: &SchemaRef, rows: u64) -> Result<WriterProperties> {
    let index = |name: &String| {
        arrow_schema.index_of(name).map(|i| SortingColumn { column_idx: i as i32, descending: false, nulls_first: false })
    };
    let sorting = schema.sort.iter().map(index).collect::<Result<Vec<_>, _>>().map_err(|e| Error::Bug(e.to_string()))?;
    let unit = |field: &Arc<arrow::datatypes::Field>| {
        field.metadata().get("unit").map(|unit| (field.name().clone(), unit.clone().into()))
    };
    let units: serde_json::Map<String, serde_json::Value> = arrow_schema.fields().iter().filter_map(unit).collect();
    let key_values = [
        (SCHEMA, schema.id()),
        ("calib.description", schema.description.clone()),
        ("calib.primary_key", schema.primary_key.join(",")),
        (UNITS, super::key::canonical(&units.into())),
    ];
    let level = ZstdLevel::try_new(3).map_err(|e| Error::Bug(e.to_string()))?;
    let compression = if rows < SMALL_ROWS { Compression::SNAPPY } else { Compression::ZSTD(level) };
    let mut properties = WriterProperties::builder()
        .set_compression(compression)
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_sorting_columns(Some(sorting))
        .set_key_value_metadata(Some(key_values.map(|(key, value)| KeyValue::new(key.into(), value)).into()))
        .set_dictionary_enabled(false);
    // Measured numbers hardly ever repeat; names of sets, steps and files do.
    for field in arrow_schema.fields().iter().filter(|field| field.data_type() == &DataType::Utf8) {
        properties = properties.set_column_dictionary_enabled(ColumnPath::from(field.name().as_str()), true);
    }
    Ok(properties.build())
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
        Ok((self.file.get_ref().try_clone()?, FileHash::of_hasher(&self.hasher), self.bytes))
    }
}
