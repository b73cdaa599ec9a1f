//! A table's Parquet file decoded: what it says of itself, its columns, and the hash of what they hold.

use arrow::array::{ArrayRef, RecordBatch};
use arrow::compute::concat_batches;
use arrow::datatypes::{Field, Schema, SchemaRef};
use parquet::arrow::arrow_reader::{
    ArrowReaderOptions, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
};
use parquet::file::reader::ChunkReader;
use std::collections::BTreeMap;
use std::sync::Arc;

use super::content::{TableHash, hash_of_columns};
use super::frame::{Frame, FrameBuilder};
use super::schema::{self, Version};
use super::writer::UNITS;
use crate::error::{Error, Result};
use crate::raw;

/// The columns of a table, by name.
type NamedArrays = BTreeMap<String, ArrayRef>;

/// Rows that are decoded at a time.
const BATCH_ROWS: usize = 1 << 16;

pub(super) struct Decoded {
    said: BTreeMap<String, String>,
    batch: RecordBatch,
}

impl Decoded {
    /// Decodes a whole file, or says why that cannot be.
    pub fn of<R: ChunkReader + 'static>(source: R) -> Result<Self, String> {
        raw::decoded(|| Self::parse(source)).and_then(|parsed| parsed)
    }

    fn parse<R: ChunkReader + 'static>(source: R) -> Result<Self, String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        let DecodedChunks {
            said,
            schema,
            file_schema,
            reader,
            ..
        } = DecodedChunks::parse(source)?;
        let batches = reader
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| text(&error))?;
        let batch = concat_batches(&file_schema, &batches).map_err(|error| text(&error))?;
        let batch =
            RecordBatch::try_new(schema, batch.columns().to_vec()).map_err(|error| text(&error))?;
        Ok(Self { said, batch })
    }

    /// The file's own key-value metadata.
    pub fn metadata_value(&self, key: &str) -> Option<&str> {
        self.said.get(key).map(String::as_str)
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
        let names = self
            .batch
            .schema_ref()
            .fields()
            .iter()
            .map(|field| field.name().clone());
        let pairs: Vec<_> = names.zip(self.batch.columns().iter().cloned()).collect();
        if let Some(twice) = pairs
            .iter()
            .enumerate()
            .find(|(at, (name, _))| pairs[..*at].iter().any(|(other, _)| other == name))
        {
            return Err(Error::Bug(format!(
                "table {kind}: column {} twice",
                twice.1.0
            )));
        }
        let columns: NamedArrays = pairs.into_iter().collect();
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
    said: BTreeMap<String, String>,
    /// With the units of columns, and as Parquet has it.
    schema: SchemaRef,
    file_schema: SchemaRef,
    reader: ParquetRecordBatchReader,
    begun: bool,
}

impl DecodedChunks {
    /// Opens a file, or says why that cannot be.
    pub fn of<R: ChunkReader + 'static>(source: R) -> Result<Self, String> {
        raw::decoded(|| Self::parse(source)).and_then(|parsed| parsed)
    }

    fn parse<R: ChunkReader + 'static>(source: R) -> Result<Self, String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        // Arrow's own description of the columns is left aside: Parquet's says as much of the types that tables have.
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(source, options)
            .map_err(|error| text(&error))?;
        let pairs = builder
            .metadata()
            .file_metadata()
            .key_value_metadata()
            .into_iter()
            .flatten();
        let said: BTreeMap<String, String> = pairs
            .filter_map(|pair| Some((pair.key.clone(), pair.value.clone()?)))
            .collect();
        let units: BTreeMap<String, String> = said
            .get(UNITS)
            .and_then(|text| serde_json::from_str(text).ok())
            .unwrap_or_default();
        let file_schema = builder.schema().clone();
        let with_unit = |field: &Arc<Field>| {
            let unit = units
                .get(field.name())
                .map(|unit| ("unit".to_string(), unit.clone()));
            field
                .as_ref()
                .clone()
                .with_metadata(unit.into_iter().collect())
        };
        let schema = Arc::new(Schema::new(
            file_schema
                .fields()
                .iter()
                .map(with_unit)
                .collect::<Vec<_>>(),
        ));
        let reader = builder
            .with_batch_size(BATCH_ROWS)
            .build()
            .map_err(|error| text(&error))?;
        Ok(Self {
            said,
            schema,
            file_schema,
            reader,
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
            said: self.said.clone(),
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
    Ok(added
        .map(|field| {
            (
                field.name.clone(),
                arrow::array::new_null_array(&field.column_type.arrow(), rows),
            )
        })
        .collect())
}
