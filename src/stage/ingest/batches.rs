//! Rows of a file that holds columns, as the same records that text gives.
//!
//! Cells become text and numbers again: a number of 64 bits comes back the same, and there is one way of judging rows.

use super::record::{RecordFields, RecordReader};
use crate::error::{Error, Result};
use arrow::array::RecordBatch;
use arrow::datatypes::SchemaRef;
use arrow::util::display::{ArrayFormatter, FormatOptions};
use std::fmt::{Display, Write};
use std::ops::Range;

/// Rows held as text at a time.
pub(super) const BATCH: usize = 1 << 10;

/// What a decoder gives, batch by batch; what is wrong with the file comes in words.
pub(super) struct Batches {
    /// Its columns, as the file declares them.
    pub schema: SchemaRef,
    /// Size of the file, bytes.
    pub size: u64,
    /// Rows of the file, where it says so.
    pub rows: Option<u64>,
    /// The rows.
    pub batches: Box<dyn Iterator<Item = Result<RecordBatch, String>> + Send>,
}

/// Reads one file from its names to its last row.
pub(super) struct BatchReader {
    label: String,
    /// E.g. `a Parquet file`.
    what: &'static str,
    source: Batches,
    is_named: bool,
    batch: Option<RecordBatch>,
    /// The cells of some rows, column by column.
    text: String,
    cells: Vec<Range<usize>>,
    /// How many rows `cells` holds, and the next of them.
    held: usize,
    next: usize,
    rows: u64,
}

impl BatchReader {
    /// Hands out what a decoder of `what` gives.
    pub(super) fn new(label: &str, what: &'static str, source: Batches) -> Self {
        Self {
            label: label.into(),
            what,
            source,
            is_named: false,
            batch: None,
            text: String::new(),
            cells: Vec::new(),
            held: 0,
            next: 0,
            rows: 0,
        }
    }
    /// Makes text of the next rows; false at the end.
    fn refill(&mut self) -> Result<bool> {
        let batch = match self.batch.take() {
            Some(batch) => batch,
            None => match self.source.batches.next() {
                Some(batch) => batch.map_err(|error| broken(&self.label, self.what, error))?,
                None => return Ok(false),
            },
        };
        (self.held, self.next) = (batch.num_rows().min(BATCH), 0);
        self.text.clear();
        self.cells.clear();
        for column in batch.columns() {
            let cells = ArrayFormatter::try_new(column, &FormatOptions::default());
            let cells = cells.map_err(|error| broken(&self.label, self.what, error))?;
            for row in 0..self.held {
                let start = self.text.len();
                write!(self.text, "{}", cells.value(row)).map_err(|error| broken(&self.label, self.what, error))?;
                self.cells.push(start..self.text.len());
            }
        }
        let left = batch.num_rows() - self.held;
        self.batch = (left > 0).then(|| batch.slice(self.held, left));
        Ok(true)
    }
}

impl RecordReader for BatchReader {
    fn label(&self) -> &str {
        &self.label
    }
    fn next(&mut self, record: &mut RecordFields) -> Result<bool> {
        record.begin(self.rows);
        if !std::mem::replace(&mut self.is_named, true) {
            self.source.schema.fields().iter().for_each(|field| record.push(field.name().as_bytes()));
            return Ok(true);
        }
        while self.next == self.held {
            if !self.refill()? {
                return Ok(false);
            }
        }
        self.rows += 1;
        record.begin(self.rows);
        let own = self.cells.iter().skip(self.next).step_by(self.held);
        own.for_each(|cell| record.push(self.text[cell.clone()].as_bytes()));
        self.next += 1;
        Ok(true)
    }
    fn lines(&self) -> u64 {
        self.rows
    }
    /// Progress as a part of the file.
    fn bytes(&self) -> u64 {
        let all = self.source.rows.unwrap_or_default().max(1);
        (u128::from(self.source.size) * u128::from(self.rows.min(all)) / u128::from(all)) as u64
    }
}

/// The fault of a file whose decoder gives up.
pub(super) fn broken(label: &str, what: &str, error: impl Display) -> Error {
    Error::data(label, format!("is {what} that cannot be read: {error}"))
}
