//! A stored table from the bytes of its Parquet file, where the file is an input of its own and not an object of this store.

use bytes::Bytes;

use super::frame::{Frame, FrameBuilder};
use crate::error::{Error, Result};
use crate::raw;

/// Rows read at a time.
const BATCH: usize = 1 << 16;

/// Reads a table of a kind; `label` names the file in errors, which are the data's.
pub(crate) fn frame(kind: &str, label: &str, bytes: Vec<u8>) -> Result<Frame> {
    let unreadable = |error: &dyn std::fmt::Display| Error::data(label, format!("not a Parquet file of table {kind}: {error}"));
    let batch = raw::parquet(Bytes::from(bytes), BATCH).and_then(raw::ParquetFile::whole).map_err(|error| unreadable(&error))?;
    let mut frame = FrameBuilder::new(kind);
    for (field, column) in batch.schema().fields().iter().zip(batch.columns()) {
        frame.push(field.name(), column.clone());
    }
    frame.finish().map_err(|error| unreadable(&error))
}
