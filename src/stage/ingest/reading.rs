//! One reading of one file from top to bottom, row by row.

use super::arm::RobotJoints;
use super::bind::{FileHeader, bind};
use super::clock::ClockColumn;
use super::encoding;
use super::layout::{Decimal, FileLayout, LimitPolicy};
use super::lines::{RecordFields, TextReader, failed};
use super::listing::ListingReader;
use super::parquet::ParquetReader;
use super::row::{RecordedRow, RowReader, RowRefusal};
use crate::error::{Error, Result, counted};
use crate::program::listing;
use crate::raw::{self, Utf16Reader, Workbook, is_utf16, is_workbook};
use crate::stage::{Context, OpenedInput};
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// How many rows pass between two signs of progress.
const STRIDE: u64 = 4096;

/// The rows of a file of either kind.
enum FileReader {
    Text(TextReader),
    Parquet(Box<ParquetReader>),
    Program(ListingReader),
}

impl FileReader {
    fn open(source: OpenedInput, layout: &FileLayout) -> Result<Self> {
        let mut reader = BufReader::with_capacity(1 << 16, source.reader);
        // The mark of four bytes is in the first buffer of any file that is long enough to be one.
        let head = reader.fill_buf().map_err(|error| failed(&source.label, &error))?;
        if is_workbook(head) {
            return Ok(Self::Text(sheet(reader, &source.label, layout)?));
        }
        if let Some(sheet) = &layout.sheet {
            let message = format!("is no workbook, and has no sheet `{sheet}`; allowed: a file .xlsx or .xlsm, or no `sheet`");
            return Err(Error::data(&source.label, message));
        }
        if let Some(language) = listing(&raw::ending(Path::new(&source.label)), head) {
            return Ok(Self::Program(ListingReader::open(reader, &source.label, language)?));
        }
        if head.starts_with(b"PAR1") {
            return Ok(Self::Parquet(Box::new(ParquetReader::open(reader, &source.label)?)));
        }
        if is_utf16(head) {
            let text: Box<dyn Read + Send> = Box::new(Utf16Reader::new(reader));
            return Ok(Self::Text(TextReader::open(BufReader::with_capacity(1 << 16, text), &source.label, layout)?));
        }
        Ok(Self::Text(TextReader::open(reader, &source.label, layout)?))
    }
    fn label(&self) -> &str {
        match self {
            Self::Text(lines) => &lines.label,
            Self::Parquet(columns) => &columns.label,
            Self::Program(listing) => &listing.label,
        }
    }
    fn next(&mut self, record: &mut RecordFields) -> Result<bool> {
        match self {
            Self::Text(lines) => lines.next(record),
            Self::Parquet(columns) => columns.next(record),
            Self::Program(listing) => Ok(listing.next(record)),
        }
    }
    fn lines(&self) -> u64 {
        match self {
            Self::Text(lines) => lines.lines,
            Self::Parquet(columns) => columns.rows,
            Self::Program(listing) => listing.line(),
        }
    }
    fn bytes(&self) -> u64 {
        match self {
            Self::Text(lines) => lines.bytes,
            Self::Parquet(columns) => columns.bytes(),
            Self::Program(listing) => listing.rows as u64,
        }
    }
}

/// A sheet of a workbook as text: its cells are delimited, and its numbers have the decimal mark that the settings announce.
fn sheet(source: impl Read, label: &str, layout: &FileLayout) -> Result<TextReader> {
    let data = |message: String| Error::data(label, message);
    let mut book = Workbook::read(source).map_err(data)?;
    let name = book.sheet(layout.sheet.as_deref()).map_err(data)?;
    let mark = if layout.decimal == Decimal::Comma { ',' } else { '.' };
    let lines: Box<dyn Read + Send> = Box::new(Cursor::new(book.lines(&name, mark).map_err(data)?));
    let layout = FileLayout { delimiter: "tab".into(), ..layout.clone() };
    TextReader::open(BufReader::new(lines), &format!("{label} sheet `{name}`"), &layout)
}

/// An opened file below its header.
pub(super) struct OpenedFile<'a> {
    pub label: String,
    rows: FileReader,
    pub record: RecordFields,
    pub row: RecordedRow,
    reader: RowReader<'a>,
    /// The record already holds the first row.
    ahead: bool,
}

impl<'a> OpenedFile<'a> {
    /// Opens a file and finds its columns.
    pub(super) fn open(source: OpenedInput, layout: &FileLayout, arm: &'a RobotJoints, limits: LimitPolicy) -> Result<Self> {
        let mut rows = FileReader::open(source, layout)?;
        let label = rows.label().to_string();
        let (header, decimal) = match &rows {
            FileReader::Text(_) => (layout.header, layout.decimal),
            FileReader::Parquet(_) | FileReader::Program(_) => (true, Decimal::Point),
        };
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
            if let FileReader::Text(lines) = &mut rows {
                lines.skip(layout.skip_below_header)?;
            }
        }
        let binding = bind(layout, &head, arm)?;
        let reader = RowReader { binding, decimal, limits, arm, last_sequence: None, clock: ClockColumn::default() };
        Ok(Self { label, rows, record, row: RecordedRow::default(), reader, ahead: !header })
    }
    /// Lines of the file read so far; of a Parquet file its rows.
    pub(super) fn lines(&self) -> u64 {
        self.rows.lines()
    }
    /// Bytes read so far.
    pub(super) fn bytes(&self) -> u64 {
        self.rows.bytes()
    }
    /// What was left out of the file as a whole, and what it lacks.
    pub(super) fn remarks(&self) -> Vec<String> {
        let left = if let FileReader::Program(listing) = &self.rows { listing.remark() } else { None };
        left.into_iter().chain(self.reader.binding.missing.iter().cloned()).collect()
    }
    /// The slots that the file fills, and what it lacks.
    pub(super) fn binding(&self) -> &super::bind::Binding {
        &self.reader.binding
    }
    /// Reads the next row into `self.row`: used or refused; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Result<(), RowRefusal>>> {
        if !std::mem::take(&mut self.ahead) && !self.rows.next(&mut self.record)? {
            return Ok(None);
        }
        self.row.number += 1;
        Ok(Some(self.reader.read(&self.record, &mut self.row)))
    }
}

/// Whether a file has the columns that are mapped; without a robot, those that do not depend on its joints.
pub(super) fn header(layout: &FileLayout, arm: Option<&RobotJoints>, limits: LimitPolicy, context: &Context) -> Result<()> {
    let source = context.services.open(&layout.file)?;
    if let Some(arm) = arm {
        return OpenedFile::open(source, layout, arm, limits).map(drop);
    }
    let layout = FileLayout { columns: layout.columns.without_joints(), ..layout.clone() };
    let arm = RobotJoints::new(vec![false], vec![[f64::NEG_INFINITY, f64::INFINITY]]);
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
