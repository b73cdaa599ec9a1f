//! One reading of one file from top to bottom, row by row.

use super::arm::RobotJoints;
use super::bind::{FileHeader, bind};
use super::encoding;
use super::judging::JudgedFile;
use super::layout::{Decimal, FileLayout, LimitPolicy};
use super::record::{BUFFER, FileFormat, RecordFields, RecordReader, failed};
use super::recorded::RecordedRow;
use super::refusal::RowRefusal;
use super::row::RowReader;
use super::{feather, lines, listing, parquet, workbook};
use crate::error::{Error, Result, counted};
use crate::raw;
use crate::stage::{Context, OpenedInput};
use crate::table::RejectedRow;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

/// How many rows pass between two signs of progress.
const STRIDE: u64 = 4096;

/// Every kind of file; the first that a file is, text at last.
const FORMATS: &[&FileFormat] = &[&workbook::FORMAT, &listing::FORMAT, &parquet::FORMAT, &feather::FORMAT, &lines::FORMAT];

/// Opens a file of any kind.
pub(super) fn records(source: OpenedInput, layout: &FileLayout) -> Result<Box<dyn RecordReader>> {
    let mut reader = BufReader::with_capacity(BUFFER, source.reader);
    let head = reader.fill_buf().map_err(|error| failed(&source.label, &error))?;
    let ending = raw::ending(Path::new(&source.label));
    let format = FORMATS.iter().find(|format| (format.is)(&ending, head)).expect("text at last");
    if let Some(sheet) = layout.sheet.as_ref().filter(|_| !format.has_sheets) {
        let message = format!("is no workbook, and has no sheet `{sheet}`; allowed: a file .xlsx or .xlsm, or no `sheet`");
        return Err(Error::data(&source.label, message));
    }
    (format.open)(reader, &source.label, layout)
}

/// Names of the columns and the first rows, up to `most`, of a file of columns; none of a file of another kind.
pub fn first_rows(source: Box<dyn Read + Send>, label: &str, most: usize) -> Result<Option<FirstRows>> {
    let mut reader = BufReader::with_capacity(BUFFER, source);
    let head = reader.fill_buf().map_err(|error| failed(label, &error))?;
    let mut rows = match () {
        () if (parquet::FORMAT.is)("", head) => parquet::read(reader, label)?,
        () if (feather::FORMAT.is)("", head) => feather::read(reader, label)?,
        () => return Ok(None),
    };
    let mut record = RecordFields::default();
    let mut found = Vec::new();
    while found.len() <= most && rows.next(&mut record)? {
        let cell = |index| encoding::shown(record.field(index).unwrap_or_default()).into_owned();
        found.push((0..record.len()).map(cell).collect::<Vec<String>>());
    }
    Ok(Some(FirstRows { names: found.remove(0), rows: found }))
}

/// How a file of columns begins.
pub struct FirstRows {
    /// Of the columns.
    pub names: Vec<String>,
    /// Their cells, as text.
    pub rows: Vec<Vec<String>>,
}

/// An opened file below its header.
pub(super) struct OpenedFile {
    pub label: String,
    pub rows: JudgedFile,
    /// What was left out of the file as a whole.
    remark: Option<String>,
    /// Columns that nothing is read from, with their names.
    pub unmapped: Vec<(usize, String)>,
    pub row: RecordedRow,
}

impl OpenedFile {
    /// Opens a file and finds its columns.
    pub(super) fn open(source: OpenedInput, layout: &FileLayout, arm: &Arc<RobotJoints>, limits: LimitPolicy) -> Result<Self> {
        let mut rows = records(source, layout)?;
        let label = rows.label().to_string();
        let (header, decimal) = if rows.is_text() { (layout.header, layout.decimal) } else { (true, Decimal::Point) };
        let mut record = RecordFields::default();
        if !rows.next(&mut record)? {
            let lines = counted(rows.lines(), "line");
            let message = match (rows.bytes(), header) {
                (0, true) => "is empty; allowed: a header and at least one data row".to_string(),
                (0, false) => "is empty; allowed: at least one data row".to_string(),
                (_, true) => format!("has no header: {lines}, all empty, comments or skipped"),
                (_, false) => format!("has no data row: {lines}, all empty, comments or skipped"),
            };
            return Err(Error::data(label, message));
        }
        let mut head = FileHeader { label: label.clone(), line: record.line, width: record.len(), names: None };
        if header {
            let name = |index| encoding::shown(record.field(index).unwrap_or_default()).into_owned();
            let mut names: Vec<String> = (0..record.len()).map(name).collect();
            // A delimiter at the end of the header makes no column.
            while names.last().is_some_and(String::is_empty) {
                names.pop();
            }
            head.width = names.len();
            head.names = Some(names);
            rows.skip(layout.skip_below_header)?;
        }
        let binding = bind(layout, &head, arm)?;
        let row = RecordedRow::of(&binding, arm);
        let names = head.names.into_iter().flatten().enumerate();
        let unmapped = names.filter(|(column, _)| binding.cells.iter().all(|cell| cell.column != *column)).collect();
        let (remark, first) = (rows.remark(), (!header).then_some(record));
        let rows = JudgedFile::new(rows, first, RowReader::new(binding, decimal, limits, arm));
        Ok(Self { label, rows, remark, unmapped, row })
    }
    /// What was left out of the file as a whole, and what it lacks.
    pub(super) fn remarks(&self) -> Vec<String> {
        self.remark.iter().chain(&self.rows.binding().missing).cloned().collect()
    }
    /// The present row as one that is not used, of the file that tables call `name`.
    pub(super) fn rejected(&self, name: &str, refusal: RowRefusal) -> RejectedRow {
        RejectedRow {
            file: name.into(),
            line: self.row.line as i64,
            point_id: (!self.row.id.is_empty()).then(|| self.row.id.clone()),
            reason: refusal.reason.word().into(),
            detail: refusal.detail,
            text: self.rows.shown(),
        }
    }
    /// Reads the next row into `self.row`: used or refused; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Result<(), RowRefusal>>> {
        self.rows.next(&mut self.row)
    }
}

/// Whether a file has the columns that are mapped; without a robot, those that do not depend on its joints.
pub(super) fn header(layout: &FileLayout, arm: Option<&Arc<RobotJoints>>, limits: LimitPolicy, context: &Context) -> Result<()> {
    let source = context.services.open(&layout.file)?;
    if let Some(arm) = arm {
        return OpenedFile::open(source, layout, arm, limits).map(drop);
    }
    let layout = FileLayout { columns: layout.columns.without_joints(), ..layout.clone() };
    let arm = Arc::new(RobotJoints::new(vec![false], vec![[f64::NEG_INFINITY, f64::INFINITY]]));
    OpenedFile::open(source, &layout, &arm, limits).map(drop)
}

/// Counts units of work up to the next sign of progress.
pub(super) struct ProgressCounter<'a> {
    context: &'a Context<'a>,
    rows: u64,
}

impl<'a> ProgressCounter<'a> {
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
