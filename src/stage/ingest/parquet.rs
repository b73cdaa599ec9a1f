//! Rows of a flat Parquet file, as the same records that text gives. The compressed file is held in memory.
//!
//! Cells become text and numbers again: a number of 64 bits comes back the same, and there is one way of judging rows.

use super::lines::{RecordFields, failed};
use crate::error::{Error, Result};
use crate::raw::{self, ParquetFile};
use arrow::array::RecordBatch;
use arrow::util::display::{ArrayFormatter, FormatOptions};
use std::fmt::{Display, Write};
use std::io::Read;

/// Rows held in memory at a time.
const BATCH: usize = 1 << 10;

/// Reads one file from its names to its last row.
pub(super) struct ParquetReader {
    reader: ParquetFile,
    pub label: String,
    names: Option<Vec<String>>,
    batch: Option<(RecordBatch, usize)>,
    /// Rows read so far.
    pub rows: u64,
    size: u64,
    cell: String,
}

impl ParquetReader {
    pub(super) fn open(mut source: impl Read, label: &str) -> Result<Self> {
        let mut content = Vec::new();
        source.read_to_end(&mut content).map_err(|error| failed(label, &error))?;
        let size = content.len() as u64;
        let reader = raw::parquet(bytes::Bytes::from(content), BATCH).map_err(|error| broken(label, error))?;
        let names = reader.schema.fields().iter().map(|field| field.name().clone()).collect();
        let (rows, cell) = (0, String::new());
        Ok(Self { reader, label: label.into(), names: Some(names), batch: None, rows, size, cell })
    }
    /// Progress as a part of the file, bytes.
    pub(super) fn bytes(&self) -> u64 {
        (u128::from(self.size) * u128::from(self.rows) / u128::from(self.reader.rows.max(1))) as u64
    }
    /// The names of the columns, then row by row; false at the end of the file.
    pub(super) fn next(&mut self, record: &mut RecordFields) -> Result<bool> {
        record.begin(self.rows);
        if let Some(names) = self.names.take() {
            names.iter().for_each(|name| record.push(name.as_bytes()));
            return Ok(true);
        }
        loop {
            if let Some((batch, row)) = &mut self.batch
                && *row < batch.num_rows()
            {
                self.rows += 1;
                record.begin(self.rows);
                let options = FormatOptions::default();
                for column in batch.columns() {
                    self.cell.clear();
                    let cell = ArrayFormatter::try_new(column, &options).map_err(|error| broken(&self.label, error))?;
                    write!(self.cell, "{}", cell.value(*row)).map_err(|error| broken(&self.label, error))?;
                    record.push(self.cell.as_bytes());
                }
                *row += 1;
                return Ok(true);
            }
            match self.reader.next() {
                Some(batch) => self.batch = Some((batch.map_err(|error| broken(&self.label, error))?, 0)),
                None => return Ok(false),
            }
        }
    }
}

fn broken(label: &str, error: impl Display) -> Error {
    Error::data(label, format!("is a Parquet file that cannot be read: {error}"))
}
