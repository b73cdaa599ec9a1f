//! Parquet files back to frames: the file's hash first, then schema and version, then the columns and the hash of what they hold.

use super::disk::refused;
use super::frame::{Frame, FrameBuilder};
use super::key::{FileHash, TableHash, TableRef, hash_of_columns};
use super::schema::{self, FieldSchema, Version};
use super::writer::{CONTENT_HASH, SCHEMA, UNITS};
use crate::error::{Error, Fault, Result};
use crate::raw;
use arrow::array::{ArrayRef, RecordBatch, new_null_array};
use arrow::compute::concat_batches;
use arrow::datatypes::{Field, Schema, SchemaRef};
use parquet::arrow::arrow_reader::{
    ArrowReaderOptions, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::FileMetaData;
use parquet::file::reader::ChunkReader;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// A table from a file outside of a store.
#[derive(Debug, Clone, PartialEq)]
pub struct Loose<T> {
    /// Its content.
    pub table: T,
    /// Whether the file carries the hash of its content. One that does not was written by another program: nobody can tell whether
    /// its numbers were changed.
    pub vouched: bool,
}

/// Opens a published table whose bytes are those that were published; another file is set aside, so that the next run makes it anew.
fn open_published(path: &Path, table: &TableRef) -> Result<File> {
    let open = || File::open(path).map_err(|e| unopened(path, &e));
    let found = FileHash::of_reader(open()?).map_err(|e| refused(path, "read", &e))?;
    if found != table.file_hash {
        return Err(set_aside(
            path,
            "its bytes are not those that were published",
        ));
    }
    open()
}

/// A published table that is read chunk by chunk: its bytes were those that were published when it was opened.
pub struct PublishedTable {
    path: PathBuf,
    table: TableRef,
    /// All of it, where that is no more than a chunk: it is decoded once.
    whole: OnceLock<Frame>,
}

impl PublishedTable {
    pub(super) fn open(path: PathBuf, table: TableRef) -> Result<Self> {
        known_schema(&path.display().to_string(), &table.schema)?;
        open_published(&path, &table)?;
        Ok(Self {
            path,
            table,
            whole: OnceLock::new(),
        })
    }

    /// How many rows.
    pub fn rows(&self) -> usize {
        self.table.rows as usize
    }

    /// All of it.
    pub fn frame(&self) -> Result<Frame> {
        load(&self.path, &self.table)
    }

    /// Hands on all rows in their order; of a table without rows, one empty chunk. Fails where the file cannot be read.
    pub fn chunks(&self, take: &mut dyn FnMut(&Frame) -> Result<()>) -> Result<()> {
        if self.rows() <= BATCH_ROWS {
            if self.whole.get().is_none() {
                let _ = self.whole.set(self.frame()?);
            }
            return self.whole.get().map_or(Ok(()), take);
        }
        let (kind, version) = known_schema(&self.path.display().to_string(), &self.table.schema)?;
        let file = File::open(&self.path).map_err(|e| unopened(&self.path, &e))?;
        let mut chunks = DecodedChunks::of(file).map_err(|why| unreadable(&self.path, &why))?;
        while let Some(chunk) = (chunks.next()).map_err(|why| unreadable(&self.path, &why))? {
            take(&chunk.frame(kind, version)?)?;
        }
        Ok(())
    }
}

/// Reads a published table; a damaged file is set aside, so that the next run makes it anew.
pub(super) fn load(path: &Path, table: &TableRef) -> Result<Frame> {
    let (kind, version) = known_schema(&path.display().to_string(), &table.schema)?;
    let decoded =
        Decoded::of(open_published(path, table)?).map_err(|why| unreadable(path, &why))?;
    if decoded.rows() != table.rows {
        return Err(set_aside(
            path,
            "it has another number of rows than was published",
        ));
    }
    if decoded.table_hash(kind, version).as_ref() != Some(&table.table_hash) {
        return Err(set_aside(path, "its content is not what was published"));
    }
    decoded.frame(kind, version)
}

fn unreadable(path: &Path, why: &str) -> Error {
    let message = format!("not a readable Parquet file: {why}");
    Error::store(path.display().to_string(), message)
}

/// Why a published table does not open: one that is gone, or has something else in its place, no waiting brings back.
fn unopened(path: &Path, error: &io::Error) -> Error {
    let place = path.display().to_string();
    match error.kind() {
        io::ErrorKind::NotFound => Error::store(
            place,
            "the table is gone; `calib run` of its pipeline writes it anew",
        ),
        io::ErrorKind::IsADirectory => Error::store(
            place,
            "a folder stands in the table's place; remove it, and `calib run` of its pipeline writes the table anew",
        ),
        _ => refused(path, "read", error),
    }
}

/// The kind of a schema id `name/version` that this calib can read.
fn known_schema<'a>(place: &str, id: &'a str) -> Result<(&'a str, Version)> {
    let refused = |message: String| Err(Error::store(place, message));
    let parts = id
        .split_once('/')
        .and_then(|(kind, version)| Some((kind, Version::parse(version)?)));
    let Some((kind, version)) = parts else {
        return refused(format!("schema `{id}` is not of the form name/1.0.0"));
    };
    let known = schema::all().find(|schema| schema.name == kind);
    match known.map(|schema| schema.version) {
        Some(known) if known.major == version.major && version.minor <= known.minor => {
            Ok((kind, version))
        }
        Some(known) => refused(format!(
            "the table is {id}, this calib reads {kind}/{known}: use the calib that wrote it, or a newer one"
        )),
        None => refused(format!(
            "this calib knows no table `{kind}`: use the calib that wrote it, or a newer one"
        )),
    }
}

/// Reads a table that is not in a store, of the kind that it names or of the one that is given. Where the file carries the hash of its
/// content, that must be the hash of what was read.
pub fn read_table(path: &Path, kind: Option<&str>) -> Result<Loose<Frame>> {
    let place = path.display().to_string();
    let file = raw::open(path).map_err(|e| Error::spec(&place, format!("cannot be read: {e}")))?;
    loose(&place, file, kind)
}

/// The same from the bytes of the file, which `label` names in errors.
pub fn table_of_bytes(label: &str, bytes: Vec<u8>, kind: &str) -> Result<Loose<Frame>> {
    loose(label, bytes::Bytes::from(bytes), Some(kind))
}

fn loose<R: ChunkReader + 'static>(
    place: &str,
    source: R,
    kind: Option<&str>,
) -> Result<Loose<Frame>> {
    let decoded = Decoded::of(source)
        .map_err(|why| Error::data(place, format!("not a readable Parquet file: {why}")))?;
    let id = decoded.metadata_value(SCHEMA).map(String::from);
    let (kind, version) = match (kind, &id) {
        (Some(kind), Some(id)) if id.split_once('/').is_none_or(|(named, _)| named != kind) => {
            return Err(Error::data(
                place,
                format!("says that it is a table `{id}`; expected a table `{kind}` of calib"),
            ));
        }
        (_, Some(id)) => known_schema(place, id).map_err(|error| of_the_data(place, error))?,
        (Some(kind), None) => (kind, schema::of(kind)?.version),
        (None, None) => {
            return Err(Error::spec(
                place,
                "does not say which table it is; say so with --as KIND",
            ));
        }
    };
    let carried = decoded.metadata_value(CONTENT_HASH);
    if carried.is_some_and(|carried| {
        decoded
            .table_hash(kind, version)
            .is_none_or(|found| found.as_str() != carried)
    }) {
        let message = format!(
            "its content is not what calib wrote: the hash that it carries (`{CONTENT_HASH}`) does not match its numbers. Take the file again \
             from the store that it comes from, where `calib run` writes it anew"
        );
        return Err(Error::data(place, message));
    }
    let vouched = carried.is_some();
    let table = decoded
        .frame(kind, version)
        .map_err(|error| of_the_data(place, error))?;
    Ok(Loose { table, vouched })
}

/// What is wrong with a file that a person named is wrong with the data, wherever it showed.
fn of_the_data(place: &str, error: Error) -> Error {
    match error {
        Error::Bug(message) => Error::data(place, message),
        Error::Store(fault) => Error::Data(vec![fault]),
        Error::Data(faults) => Error::Data(
            faults
                .into_iter()
                .map(|fault| Fault::new(format!("{place}: {}", fault.place), fault.message))
                .collect(),
        ),
        other => other,
    }
}

/// Takes a damaged object out of the way.
fn set_aside(path: &Path, why: &str) -> Error {
    let place = path.display().to_string();
    let (what, error) = match fs::rename(path, path.with_extension("damaged")) {
        Ok(()) => ("it was set aside", String::new()),
        Err(e) => ("remove it", format!(" ({e})")),
    };
    let message =
        format!("damaged: {why}; {what}, and `calib run` of its pipeline writes it anew{error}");
    Error::store(place, message)
}

/// What a file says of itself, by key, and of the units of its columns, by name.
pub fn file_notes(footer: &FileMetaData) -> (BTreeMap<String, String>, BTreeMap<String, String>) {
    let pairs = footer.key_value_metadata().into_iter().flatten();
    let notes: BTreeMap<String, String> = pairs
        .filter_map(|pair| Some((pair.key.clone(), pair.value.clone()?)))
        .collect();
    let units = notes.get(UNITS);
    let units = units.and_then(|text| serde_json::from_str(text).ok());
    (notes, units.unwrap_or_default())
}

/// The columns of a table, by name.
type NamedArrays = BTreeMap<String, ArrayRef>;

/// Rows that are decoded at a time.
const BATCH_ROWS: usize = 1 << 16;

pub(super) struct Decoded {
    metadata: Arc<BTreeMap<String, String>>,
    batch: RecordBatch,
}

impl Decoded {
    /// Decodes a whole file, or says why that cannot be.
    pub fn of<R: ChunkReader + 'static>(source: R) -> Result<Self, String> {
        let mut chunks = DecodedChunks::of(source)?;
        let mut batches = Vec::new();
        while let Some(chunk) = chunks.next()? {
            batches.push(chunk.batch);
        }
        let batch = concat_batches(&chunks.schema, &batches).map_err(|error| error.to_string())?;
        Ok(Self {
            metadata: chunks.metadata,
            batch,
        })
    }

    /// The file's own key-value metadata.
    pub fn metadata_value(&self, key: &str) -> Option<&str> {
        self.metadata.get(key).map(String::as_str)
    }

    pub fn rows(&self) -> u64 {
        self.batch.num_rows() as u64
    }

    /// The hash of the columns as the file has them, whichever minor version wrote them.
    pub fn table_hash(&self, kind: &str, version: Version) -> Option<TableHash> {
        hash_of_columns(kind, version.major, &self.batch)
    }

    /// The columns of an older or the newest version, checked against the newest.
    pub fn frame(self, kind: &str, version: Version) -> Result<Frame> {
        let mut columns = NamedArrays::new();
        let fields = self.batch.schema_ref().fields().iter();
        for (field, column) in fields.zip(self.batch.columns()) {
            let name = field.name();
            if columns.insert(name.clone(), column.clone()).is_some() {
                return Err(Error::Bug(format!("table {kind}: column {name} twice")));
            }
        }
        let mut frame = FrameBuilder::new(kind);
        let added = added_since(kind, version, &columns, self.batch.num_rows())?;
        for (name, column) in columns.into_iter().chain(added) {
            frame.push(name, column);
        }
        frame.finish()
    }
}

/// A file decoded chunk by chunk.
pub(super) struct DecodedChunks {
    metadata: Arc<BTreeMap<String, String>>,
    /// With the units of columns.
    schema: SchemaRef,
    reader: ParquetRecordBatchReader,
    begun: bool,
}

impl DecodedChunks {
    /// Opens a file, or says why that cannot be.
    pub fn of<R: ChunkReader + 'static>(source: R) -> Result<Self, String> {
        raw::decoded(|| Self::parse(source))?.map_err(|error| error.to_string())
    }

    fn parse<R: ChunkReader + 'static>(source: R) -> Result<Self, ParquetError> {
        // Arrow's own description of the columns is left aside: Parquet's says as much of the types that tables have.
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(source, options)?;
        let (metadata, units) = file_notes(builder.metadata().file_metadata());
        let with_unit = |field: &Arc<Field>| {
            let unit = units.get(field.name());
            let unit = unit.map(|unit| ("unit".to_string(), unit.clone()));
            let field = field.as_ref().clone();
            field.with_metadata(unit.into_iter().collect())
        };
        let fields = builder.schema().fields().iter().map(with_unit);
        Ok(Self {
            schema: Arc::new(Schema::new(fields.collect::<Vec<_>>())),
            metadata: Arc::new(metadata),
            reader: builder.with_batch_size(BATCH_ROWS).build()?,
            begun: false,
        })
    }

    /// The next rows; of a file without rows, once none.
    pub fn next(&mut self) -> Result<Option<Decoded>, String> {
        let batch =
            raw::decoded(|| self.reader.next().transpose())?.map_err(|error| error.to_string())?;
        let first = !std::mem::replace(&mut self.begun, true);
        let batch = match batch {
            Some(batch) => RecordBatch::try_new(self.schema.clone(), batch.columns().to_vec())
                .map_err(|error| error.to_string())?,
            None if first => RecordBatch::new_empty(self.schema.clone()),
            None => return Ok(None),
        };
        Ok(Some(Decoded {
            metadata: self.metadata.clone(),
            batch,
        }))
    }
}

/// Nullable columns that a later minor version has, as nulls.
fn added_since(
    kind: &str,
    version: Version,
    columns: &NamedArrays,
    rows: usize,
) -> Result<NamedArrays> {
    let schema = schema::of(kind)?;
    if version.minor == schema.version.minor {
        return Ok(NamedArrays::new());
    }
    let added = schema.fields.iter().filter(|field| {
        field.nullable && !field.optional && !field.per_joint && !columns.contains_key(&field.name)
    });
    let nulls = |field: &FieldSchema| new_null_array(&field.column_type.arrow(), rows);
    Ok(added
        .map(|field| (field.name.clone(), nulls(field)))
        .collect())
}
