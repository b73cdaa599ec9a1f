//! A Feather file: columns of Arrow as they stand in memory, as pandas, polars and R write them; it is held in memory.
//!
//! Uncompressed or by zstd. Version 1, which has no columns of Arrow's file format, is refused.

use super::batches::{BatchReader, Batches, broken};
use super::layout::FileLayout;
use super::lists::unfolded;
use super::record::{Buffered, FileFormat, RecordReader, failed};
use crate::error::{Error, Result};
use crate::raw;
use arrow_ipc::reader::FileReader;
use std::io::{Cursor, Read};

const WHAT: &str = "a Feather file";
/// How files of version 1, of version 2 begin.
const FIRST: &[u8] = b"FEA1";
const SECOND: &[u8] = b"ARROW1";

pub(super) const FORMAT: FileFormat =
    FileFormat { is: |_, head| head.starts_with(FIRST) || head.starts_with(SECOND), has_sheets: false, open };

fn open(source: Buffered, label: &str, _layout: &FileLayout) -> Result<Box<dyn RecordReader>> {
    Ok(Box::new(read(source, label)?))
}

/// Opens it; fails where it cannot be read.
pub(super) fn read(mut source: Buffered, label: &str) -> Result<BatchReader> {
    let mut content = Vec::new();
    source.read_to_end(&mut content).map_err(|error| failed(label, &error))?;
    if content.starts_with(FIRST) {
        let message = "is a Feather file of version 1; allowed: version 2, which every writer of today makes, Parquet or text";
        return Err(Error::data(label, message));
    }
    let size = content.len() as u64;
    let opened = raw::decoded(|| FileReader::try_new(Cursor::new(content), None).map_err(|error| error.to_string()));
    let mut file = opened.and_then(|file| file).map_err(|error| broken(label, WHAT, error))?;
    let schema = file.schema();
    // A decoder that gave up is not asked again.
    let mut whole = true;
    let batches = std::iter::from_fn(move || {
        let next = if whole { raw::decoded(|| file.next()) } else { Ok(None) };
        let batch =
            next.map_or_else(|message| Some(Err(message)), |batch| batch.map(|batch| batch.map_err(|error| said(&error))));
        whole = matches!(batch, Some(Ok(_)));
        batch
    });
    Ok(BatchReader::new(label, WHAT, unfolded(Batches { schema, size, rows: None, batches: Box::new(batches) })))
}

/// What the decoder says, and what to do where the file is compressed in a way that it does not know.
fn said(error: &arrow::error::ArrowError) -> String {
    let text = error.to_string();
    if text.contains("lz4") {
        return "its columns are compressed by LZ4; allowed: none or zstd, e.g. `to_feather(FILE, compression=\"zstd\")`".into();
    }
    text
}
