//! A Parquet file of numbers, texts and lists of numbers; compressed, it is held in memory.

use super::batches::{BATCH, BatchReader, Batches, broken};
use super::layout::FileLayout;
use super::lists::unfolded;
use super::record::{Buffered, FileFormat, RecordReader, failed};
use crate::error::Result;
use crate::raw;
use std::io::Read;

const WHAT: &str = "a Parquet file";

pub(super) const FORMAT: FileFormat = FileFormat { is: |_, head| head.starts_with(b"PAR1"), has_sheets: false, open };

fn open(source: Buffered, label: &str, _layout: &FileLayout) -> Result<Box<dyn RecordReader>> {
    Ok(Box::new(read(source, label)?))
}

/// Opens it; fails where it cannot be read.
pub(super) fn read(mut source: Buffered, label: &str) -> Result<BatchReader> {
    let mut content = Vec::new();
    source.read_to_end(&mut content).map_err(|error| failed(label, &error))?;
    let size = content.len() as u64;
    let file = raw::parquet(bytes::Bytes::from(content), BATCH).map_err(|error| broken(label, WHAT, error))?;
    let (schema, rows) = (file.schema.clone(), Some(file.rows));
    Ok(BatchReader::new(label, WHAT, unfolded(Batches { schema, size, rows, batches: Box::new(file) })))
}
