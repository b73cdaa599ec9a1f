//! A stored table from the bytes of its Parquet file, where the file is an input of its own and not an object of this store.

use arrow::compute::concat_batches;
use bytes::Bytes;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

use super::frame::{Frame, FrameBuilder};
use crate::error::{Error, Result};

/// Reads a table of a kind; `label` names the file in errors, which are the data's.
pub(crate) fn frame(kind: &str, label: &str, bytes: Vec<u8>) -> Result<Frame> {
    let unreadable = |error: &dyn std::fmt::Display| Error::data(label, format!("not a Parquet file of table {kind}: {error}"));
    let builder = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes)).map_err(|error| unreadable(&error))?;
    let schema = builder.schema().clone();
    let reader = builder.build().map_err(|error| unreadable(&error))?;
    let batches = reader.collect::<Result<Vec<_>, _>>().map_err(|error| unreadable(&error))?;
    let batch = concat_batches(&schema, &batches).map_err(|error| unreadable(&error))?;
    let mut frame = FrameBuilder::new(kind);
    for (field, column) in schema.fields().iter().zip(batch.columns()) {
        frame.push(field.name(), column.clone());
    }
    frame.finish().map_err(|error| unreadable(&error))
}
