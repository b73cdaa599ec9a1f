//! One reading of one file from top to bottom, row by row.

use super::arm::Arm;
use super::bind::{Head, bind};
use super::layout::{FileLayout, Limits};
use super::lines::{Lines, Record};
use super::row::{Refusal, Row, RowReader};
use crate::error::{Error, Result};
use crate::stage::{Context, Source};

/// How many rows pass between two signs of progress.
const STRIDE: u64 = 4096;

/// An opened file below its header.
pub(super) struct Reading<'a> {
    pub label: String,
    pub lines: Lines,
    pub record: Record,
    pub row: Row,
    reader: RowReader<'a>,
    /// The record already holds the first row.
    ahead: bool,
}

impl<'a> Reading<'a> {
    /// Opens a file and finds its columns.
    pub(super) fn open(source: Source, layout: &FileLayout, arm: &'a Arm, limits: Limits) -> Result<Self> {
        let label = source.label.clone();
        let mut lines = Lines::open(source, layout)?;
        let mut record = Record::default();
        if !lines.next(&mut record)? {
            let message = match (lines.bytes, layout.header) {
                (0, true) => "is empty; allowed: a header and at least one data row".to_string(),
                (0, false) => "is empty; allowed: at least one data row".to_string(),
                (_, true) => format!("has no header: its {} lines are empty, comments or skipped", lines.lines),
                (_, false) => format!("has no data row: its {} lines are empty, comments or skipped", lines.lines),
            };
            return Err(Error::data(label, message));
        }
        let mut head = Head { label: label.clone(), line: record.line, width: record.len(), names: None };
        if layout.header {
            let name = |index| String::from_utf8_lossy(record.field(index).unwrap_or_default()).into_owned();
            let mut names: Vec<String> = (0..record.len()).map(name).collect();
            // A delimiter at the end of the header makes no column.
            while names.last().is_some_and(String::is_empty) {
                names.pop();
            }
            head.width = names.len();
            head.names = Some(names);
            lines.skip(layout.skip_below_header)?;
        }
        let binding = bind(layout, &head, arm)?;
        let reader = RowReader { binding, decimal: layout.decimal, limits, arm, last_sequence: None };
        Ok(Self { label, lines, record, row: Row::default(), reader, ahead: !layout.header })
    }
    /// The slots that the file fills, and what it lacks.
    pub(super) fn binding(&self) -> &super::bind::Binding {
        &self.reader.binding
    }
    /// Reads the next row into `self.row`: used or refused; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Result<(), Refusal>>> {
        if !std::mem::take(&mut self.ahead) && !self.lines.next(&mut self.record)? {
            return Ok(None);
        }
        self.row.number += 1;
        Ok(Some(self.reader.read(&self.record, &mut self.row)))
    }
}

/// Counts units of work up to the next sign of progress.
pub(super) struct Pace<'a> {
    context: &'a Context<'a>,
    rows: u64,
}

impl<'a> Pace<'a> {
    pub(super) fn new(context: &'a Context<'a>) -> Self {
        Self { context, rows: 0 }
    }
    pub(super) fn row(&mut self, done: u64) {
        self.rows += 1;
        if self.rows.is_multiple_of(STRIDE) {
            self.context.services.advance(done, "");
        }
    }
}
