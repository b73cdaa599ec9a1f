//! One side of a comparison: a Parquet file opened by its footer, whose columns are read one at a time.

use arrow::array::{Array, ArrayRef, AsArray, LargeStringArray, new_empty_array};
use arrow::compute::{cast, concat};
use arrow::datatypes::{DataType, Float64Type, Schema};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use parquet::arrow::{ProjectionMask, parquet_to_arrow_schema};
use parquet::errors::ParquetError;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::{Error, Result, counted};
use crate::raw;
use crate::store::file_notes;
use crate::store::schema::{self, TableSchema, Version};

/// Rows that are decoded at a time.
const BATCH_ROWS: usize = 1 << 16;

/// What the cells of a column are to a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CellKind {
    Float,
    Int,
    Flag,
    Text,
}

#[derive(Debug, Clone)]
pub(super) struct TableColumn {
    pub(crate) name: String,
    pub(crate) kind: CellKind,
    /// As the file has it, for findings.
    pub(crate) stored: String,
    pub(crate) unit: Option<String>,
    pub(crate) semantic: Option<String>,
}

/// A Parquet file, by its footer.
pub(super) struct TableFile {
    pub(crate) path: PathBuf,
    pub(crate) rows: usize,
    pub(crate) columns: Vec<TableColumn>,
    /// Kind and version, where the file says so.
    pub(crate) table: Option<(String, Version)>,
    pub(crate) table_hash: Option<String>,
    /// Columns that tell every row from every other, where the file says so.
    pub(crate) key: Vec<String>,
    metadata: ArrowReaderMetadata,
}

impl TableFile {
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let place = path.display().to_string();
        let unreadable =
            |e: ParquetError| Error::spec(&place, format!("not a readable Parquet file: {e}"));
        let file =
            raw::open(path).map_err(|e| Error::spec(&place, format!("cannot be read: {e}")))?;
        // Arrow's own types (dictionaries, views) are left aside, so that every writer's text is plain text.
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let metadata = raw::decoded(|| ArrowReaderMetadata::load(&file, options))
            .map_err(|e| unreadable(ParquetError::General(e)))?;
        let metadata = metadata.map_err(unreadable)?;
        let footer = metadata.metadata().file_metadata();
        let rows = usize::try_from(footer.num_rows()).unwrap_or(0);
        if u32::try_from(rows).is_err() {
            return Err(Error::spec(
                place,
                format!(
                    "{}; a comparison takes up to {}",
                    counted(rows, "row"),
                    u32::MAX
                ),
            ));
        }
        let (pairs, units) = file_notes(footer);
        let rich = raw::decoded(|| {
            parquet_to_arrow_schema(footer.schema_descr(), footer.key_value_metadata())
        });
        let rich = rich.map_err(|e| unreadable(ParquetError::General(e)))?.ok();
        let columns = metadata.schema().fields().iter().map(|field| {
            let about = |key: &str| metadata_of(rich.as_ref(), field.name(), key);
            let kind = kind(field.data_type());
            TableColumn {
                name: field.name().clone(),
                kind: kind.unwrap_or(CellKind::Text),
                stored: kind.map_or_else(String::new, |_| field.data_type().to_string()),
                unit: about("unit").or_else(|| units.get(field.name()).cloned()),
                semantic: about("semantic"),
            }
        });
        let columns = columns.collect();
        let table = pairs.get("calib.schema").and_then(|id| {
            let (kind, version) = id.split_once('/')?;
            Some((kind.to_string(), Version::parse(version)?))
        });
        let key = pairs
            .get("calib.primary_key")
            .map(|key| key.split(',').map(String::from).collect())
            .unwrap_or_default();
        let table_hash = pairs.get("calib.table_hash").cloned();
        Ok(Self {
            path: path.into(),
            rows,
            columns,
            table,
            table_hash,
            key,
            metadata,
        })
    }

    /// The schema that this calib knows of the table, whatever the version.
    pub(crate) fn schema(&self) -> Option<&'static TableSchema> {
        let (kind, _) = self.table.as_ref()?;
        schema::all().find(|schema| &schema.name == kind)
    }

    pub(crate) fn position(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|known| known.name == column)
    }

    /// The place of a column that a key needs.
    pub(crate) fn key_column(&self, name: &str) -> Result<usize> {
        self.position(name).ok_or_else(|| {
            let known = self.names().join(", ");
            let message = format!("no key column `{name}`; its columns: {known}");
            Error::spec(self.path.display().to_string(), message)
        })
    }

    /// Of all columns.
    pub(crate) fn names(&self) -> Vec<&str> {
        let names = self.columns.iter();
        names.map(|column| column.name.as_str()).collect()
    }

    /// Batches of the given columns, in the given order, each cast to the type of its kind.
    pub(crate) fn stream(
        &self,
        columns: &[usize],
    ) -> Result<impl Iterator<Item = Result<Vec<ArrayRef>>> + use<>> {
        let place = self.path.display().to_string();
        for &column in columns {
            let column = &self.columns[column];
            if column.stored.is_empty() {
                let message = format!(
                    "column {} is nested or binary, which is not compared: leave it out with --ignore",
                    column.name
                );
                return Err(Error::spec(place, message));
            }
        }
        let file = File::open(&self.path)
            .map_err(|e| Error::spec(&place, format!("cannot be read: {e}")))?;
        let builder =
            ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.metadata.clone());
        let mask = ProjectionMask::roots(builder.parquet_schema(), columns.iter().copied());
        let unreadable =
            |e: String| Error::spec(&place, format!("not a readable Parquet file: {e}"));
        let reader = raw::decoded(|| {
            builder
                .with_projection(mask)
                .with_batch_size(BATCH_ROWS)
                .build()
        })
        .map_err(unreadable)?;
        let reader = reader.map_err(|e| unreadable(e.to_string()))?;
        // The reader gives columns in the file's order.
        let mut ascending: Vec<usize> = columns.to_vec();
        ascending.sort_unstable();
        ascending.dedup();
        let wanted: Vec<(usize, CellKind)> = columns
            .iter()
            .map(|column| {
                (
                    ascending.binary_search(column).unwrap_or_default(),
                    self.columns[*column].kind,
                )
            })
            .collect();
        Ok(raw::BatchFile::of(reader).map(move |batch| {
            let damaged =
                |e: String| Error::spec(&place, format!("damaged, cannot be read to its end: {e}"));
            let batch = batch.map_err(damaged)?;
            let plain = |&(at, kind): &(usize, CellKind)| {
                cast(batch.column(at), &plain_type(kind)).map_err(|e| damaged(e.to_string()))
            };
            wanted.iter().map(plain).collect()
        }))
    }

    /// A whole column.
    pub fn whole(&self, column: usize) -> Result<ArrayRef> {
        let batches = self
            .stream(&[column])?
            .map(|batch| Ok(batch?.swap_remove(0)));
        joined(batches.collect::<Result<Vec<_>>>()?, || {
            plain_type(self.columns[column].kind)
        })
    }

    /// A whole column as texts.
    pub(crate) fn whole_text(&self, column: usize) -> Result<ArrayRef> {
        let batches = self
            .stream(&[column])?
            .map(|batch| -> Result<ArrayRef> { Ok(Arc::new(texts_of(&batch?[0])?)) });
        joined(batches.collect::<Result<Vec<_>>>()?, || DataType::LargeUtf8)
    }
}

fn joined(batches: Vec<ArrayRef>, kind: impl FnOnce() -> DataType) -> Result<ArrayRef> {
    let all: Vec<&dyn Array> = batches.iter().map(AsRef::as_ref).collect();
    if all.is_empty() {
        return Ok(new_empty_array(&kind()));
    }
    concat(&all).map_err(bug)
}

/// The cells of a batch as texts; flags are 0 and 1.
pub(super) fn texts_of(cells: &ArrayRef) -> Result<LargeStringArray> {
    if cells.data_type() == &DataType::Utf8 {
        let texts = cast(cells, &DataType::LargeUtf8).map_err(bug)?;
        return Ok(texts.as_string::<i64>().clone());
    }
    let numbers = cast(cells, &DataType::Float64).map_err(bug)?;
    let numbers = numbers.as_primitive::<Float64Type>().iter();
    Ok(numbers
        .map(|number| number.map(|number| number.to_string()))
        .collect())
}

/// What cannot fail, of columns that were read.
pub(super) fn bug(error: impl std::fmt::Display) -> Error {
    Error::Bug(error.to_string())
}

fn metadata_of(schema: Option<&Schema>, column: &str, key: &str) -> Option<String> {
    schema?
        .field_with_name(column)
        .ok()?
        .metadata()
        .get(key)
        .cloned()
}

fn kind(data_type: &DataType) -> Option<CellKind> {
    use DataType as T;
    match data_type {
        T::Float16
        | T::Float32
        | T::Float64
        | T::Decimal32(..)
        | T::Decimal64(..)
        | T::Decimal128(..)
        | T::Decimal256(..) => Some(CellKind::Float),
        T::Int8 | T::Int16 | T::Int32 | T::Int64 | T::UInt8 | T::UInt16 | T::UInt32 => {
            Some(CellKind::Int)
        }
        T::Boolean => Some(CellKind::Flag),
        T::Utf8
        | T::LargeUtf8
        | T::Utf8View
        | T::UInt64
        | T::Date32
        | T::Date64
        | T::Time32(_)
        | T::Time64(_) => Some(CellKind::Text),
        T::Timestamp(..) | T::Duration(_) => Some(CellKind::Text),
        _ => None,
    }
}

fn plain_type(kind: CellKind) -> DataType {
    match kind {
        CellKind::Float => DataType::Float64,
        CellKind::Int => DataType::Int64,
        CellKind::Flag => DataType::Boolean,
        CellKind::Text => DataType::Utf8,
    }
}

/// Pieces of files that are compared byte by byte: large enough to stream, small enough that a difference ends the reading early.
const PIECE: u64 = 1 << 20;

/// Whether both files can be read and hold the same bytes.
pub(super) fn same_bytes(a: &Path, b: &Path) -> bool {
    let length = |path: &Path| std::fs::metadata(path).ok().map(|metadata| metadata.len());
    let Some(bytes) = length(a).filter(|bytes| length(b) == Some(*bytes)) else {
        return false;
    };
    let piece = |path: &Path, at: u64| -> io::Result<Vec<u8>> {
        let (mut file, mut bytes) = (raw::open(path)?, Vec::with_capacity(PIECE as usize));
        file.seek(SeekFrom::Start(at * PIECE))?;
        file.take(PIECE).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let same = |at: u64| matches!((piece(a, at), piece(b, at)), (Ok(a), Ok(b)) if a == b);
    // The end first: there lie the statistics of a Parquet file's columns, which hardly ever agree where the columns do not.
    let last = bytes.saturating_sub(1) / PIECE;
    same(last) && (0..last).into_par_iter().all(same)
}
