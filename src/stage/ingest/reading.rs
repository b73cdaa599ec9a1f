//! One reading of one file from top to bottom, row by row: what kind of file it is, and who hands out its rows.

use crate::error::{Error, Fault, Result, counted};
use crate::ingest::arm::{RobotJoints, UNLIMITED};
use crate::ingest::bind::{Binding, FileHeader, bind};
use crate::ingest::columns::{FileLayout, LimitPolicy};
use crate::ingest::external::ExternalAxes;
use crate::ingest::refusal::RowRefusal;
use crate::ingest::row::{RecordedRow, RowReader};
use crate::program::{JointList, Language, MOST_BYTES, joint_list, listing as language};
use crate::raw::{
    self, BagRows, ColumnRows, DecimalMark, Delimiter, InputSource, JsonRows, Record, RecordReader,
    TextLayout, TextRows, Workbook, failed, has_columns, is_bag, is_json, is_workbook, not_read,
};
use crate::table::{IntakeRow, Robot};
use crate::{Context, OpenedInput};
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// How many rows pass between two signs of progress.
pub(super) const STRIDE: u64 = 4096;
/// Bytes that are read at a time; what says of which kind a file is stands among the first of them.
const BUFFER: usize = 1 << 16;

/// What is said of a table beforehand.
#[derive(Default)]
pub struct TableLayout<'l> {
    /// The sheet, of a workbook.
    pub sheet: Option<&'l str>,
    /// The topic, of a recording of ROS 2.
    pub topic: Option<&'l str>,
    /// How its rows are written, of text.
    pub text: TextLayout,
    /// The decimal mark of its numbers, of text and workbooks.
    pub decimal: DecimalMark,
}

/// What a file is.
#[derive(Clone, Copy)]
pub enum FileKind {
    /// A workbook of a spreadsheet.
    Workbook,
    /// A recording of ROS 2.
    Bag,
    /// A controller's, which declares joints.
    Program(Language),
    /// Parquet or Feather.
    Columns,
    /// JSON, or lines of it.
    Json,
    /// What is known and not read, and why.
    NotRead(&'static str),
    /// Delimited text.
    Text,
}

impl FileKind {
    /// By its name and how it begins.
    pub fn of(name: &str, head: &[u8]) -> Self {
        if is_workbook(head) {
            Self::Workbook
        } else if is_bag(head) {
            Self::Bag
        } else if let Some(language) = language(&raw::ending(Path::new(name)), head) {
            Self::Program(language)
        } else if has_columns(head) {
            Self::Columns
        } else if is_json(head) {
            Self::Json
        } else {
            not_read(head).map_or(Self::Text, Self::NotRead)
        }
    }
}

/// Opens a table of any kind; with its name for messages, of a workbook with its sheet.
pub fn records(
    source: Box<dyn InputSource>,
    label: &str,
    layout: TableLayout,
) -> Result<(String, Box<dyn RecordReader>)> {
    let mut reader = BufReader::with_capacity(BUFFER, source);
    let head = reader.fill_buf().map_err(|error| failed(label, &error))?;
    let kind = FileKind::of(label, head);
    let data = |message: String| Error::data(label, message);
    if let Some(sheet) = layout.sheet.filter(|_| !matches!(kind, FileKind::Workbook)) {
        return Err(data(format!(
            "is no workbook, and has no sheet `{sheet}`; allowed: a file .xlsx or .xlsm, or no `sheet`"
        )));
    }
    if let Some(topic) = layout.topic.filter(|_| !matches!(kind, FileKind::Bag)) {
        return Err(data(format!(
            "is no recording of ROS 2, and has no topic `{topic}`; allowed: a file .mcap or .db3, or no `topic`"
        )));
    }
    let mut name = label.to_string();
    let rows: Box<dyn RecordReader> = match kind {
        FileKind::Workbook => {
            let mut book = Workbook::read(reader).map_err(data)?;
            let sheet = book.sheet(layout.sheet).map_err(data)?;
            let lines = book.lines(&sheet, layout.decimal).map_err(data)?;
            let text = TextLayout {
                delimiter: Delimiter::Byte(b'\t'),
                ..layout.text
            };
            name.push_str(&format!(" sheet `{sheet}`"));
            Box::new(TextRows::open(Cursor::new(lines), &name, text)?)
        }
        FileKind::Bag => Box::new(BagRows::open(reader.into_inner(), label, layout.topic)?),
        FileKind::Program(language) => Box::new(ListedRows::open(reader, label, language)?),
        FileKind::Columns => Box::new(ColumnRows::open(reader, label)?),
        FileKind::Json => Box::new(JsonRows::open(reader, label)?),
        FileKind::NotRead(what) => return Err(data(what.into())),
        FileKind::Text => {
            let reader = raw::without_utf16(reader).map_err(|error| failed(label, &error))?;
            let reader = BufReader::with_capacity(BUFFER, reader);
            Box::new(TextRows::open(reader, label, layout.text)?)
        }
    };
    Ok((name, rows))
}

/// An opened file below its header.
pub(super) struct OpenedFile<'a> {
    pub label: String,
    reader: Box<dyn RecordReader>,
    judge: RowReader<'a>,
    /// The present row as it stands.
    record: Record,
    /// It was read before it was asked for, to see how wide rows are.
    is_ahead: bool,
    /// What was left out of the file as a whole.
    remark: Option<String>,
    /// Axes in addition to the arm's that nothing is read from.
    pub external: ExternalAxes,
    pub row: RecordedRow,
}

impl<'a> OpenedFile<'a> {
    /// Opens a file and finds its columns.
    pub(super) fn open(
        source: OpenedInput,
        layout: &FileLayout,
        arm: &'a RobotJoints,
        limits: LimitPolicy,
    ) -> Result<Self> {
        let table = TableLayout {
            sheet: layout.sheet.as_deref(),
            topic: layout.topic.as_deref(),
            text: TextLayout {
                delimiter: Delimiter::parse(&layout.delimiter)
                    .ok_or_else(|| Error::Bug("an unchecked delimiter".into()))?,
                comment: layout.comment.clone(),
                header_in_comment: layout.header_in_comment,
                skip: layout.skip,
            },
            decimal: layout.decimal,
        };
        let (label, mut reader) = records(source.reader, &source.label, table)?;
        let (header, decimal) = match reader.obeys_layout() {
            true => (layout.header, layout.decimal),
            false => (true, DecimalMark::Point),
        };
        let mut record = Record::default();
        if !reader.next(&mut record)? {
            let lines = counted(reader.lines(), "line");
            let (all, first) = match header {
                true => ("a header and at least one data row", "header"),
                false => ("at least one data row", "data row"),
            };
            let message = match reader.bytes() {
                0 => format!("is empty; allowed: {all}"),
                _ => format!("has no {first}: {lines}, all empty, comments or skipped"),
            };
            return Err(Error::data(label, message));
        }
        let mut head = FileHeader {
            label: label.clone(),
            line: record.line,
            width: record.len(),
            names: None,
        };
        if header {
            if let Some((_, why)) = &record.fault {
                return Err(Error::data(format!("{label}:{}", record.line), why));
            }
            let mut names = record.cells();
            // A delimiter at the end of the header makes no column.
            while names.last().is_some_and(String::is_empty) {
                names.pop();
            }
            head.width = names.len();
            head.names = Some(names);
            reader.skip(layout.skip_below_header)?;
        }
        let binding = bind(layout, &head, arm)?;
        reader.only(&binding.columns());
        let row = RecordedRow::empty(arm);
        let is_mapped = |column: usize| binding.cells.iter().any(|cell| cell.column == column);
        let names = head.names.iter().flatten().enumerate();
        let unmapped = names.filter(|(column, _)| !is_mapped(*column));
        let external = ExternalAxes::among(unmapped, layout.columns.has("q"), decimal);
        Ok(Self {
            label,
            remark: reader.remark(),
            reader,
            judge: RowReader::new(binding, decimal, limits, arm),
            record,
            is_ahead: !header,
            external,
            row,
        })
    }
    /// What was left out of the file as a whole, and what it lacks.
    pub(super) fn remarks(&self) -> Vec<String> {
        let remarks = self.remark.iter().chain(&self.binding().missing);
        remarks.cloned().collect()
    }
    /// What could not be read of the file, once its last row was.
    pub(super) fn loss(&self) -> Option<String> {
        let loss = self.reader.loss();
        loss.map(|loss| format!("{}: {loss}", self.label))
    }
    pub(super) fn binding(&self) -> &Binding {
        &self.judge.binding
    }
    /// Lines of the file read so far; of a file that has no lines its rows.
    pub(super) fn lines(&self) -> u64 {
        self.reader.lines()
    }
    pub(super) fn bytes(&self) -> u64 {
        self.reader.bytes()
    }
    /// The present row as it stands.
    pub(super) fn text(&self) -> &[u8] {
        &self.record.text
    }
    /// Reads the next row into `self.row`: used or refused; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<Result<(), RowRefusal>>> {
        if !std::mem::take(&mut self.is_ahead) && !self.reader.next(&mut self.record)? {
            return Ok(None);
        }
        self.external.see(&self.record);
        self.row.number += 1;
        Ok(Some(self.judge.read(&self.record, &mut self.row)))
    }
}

/// Fails where files lack columns that are mapped; without a robot, of those that do not depend on its joints.
pub(super) fn headers<'l>(
    layouts: impl Iterator<Item = &'l FileLayout>,
    robot: Option<&Robot>,
    limits: LimitPolicy,
    context: &Context,
) -> Result<()> {
    let arm = match robot {
        Some(robot) => RobotJoints::of(robot)?,
        None => RobotJoints::new(vec![false], vec![UNLIMITED]),
    };
    let mut faults = Vec::new();
    for layout in layouts {
        let mut layout = layout.clone();
        if robot.is_none() {
            layout.columns = layout.columns.without_joints();
        }
        let source = context.services.open(&layout.file)?;
        match OpenedFile::open(source, &layout, &arm, limits) {
            Ok(_) => {}
            Err(Error::Data(more)) => faults.extend(more),
            Err(other) => return Err(other),
        }
    }
    Error::if_data(faults)
}

/// What became of the rows of a file, for the table and for the person.
pub(super) fn intake(
    file: &str,
    lines: u64,
    [read, accepted]: [u64; 2],
    context: &Context,
) -> IntakeRow {
    let rejected = read - accepted;
    context.note(format!(
        "{file}: {} read, {accepted} used, {rejected} rejected",
        counted(read, "row")
    ));
    let [lines, read, accepted, rejected] =
        [lines, read, accepted, rejected].map(|count| count as i64);
    IntakeRow {
        file: file.into(),
        lines,
        read,
        accepted,
        rejected,
    }
}

/// As a language calls an axis: six of the arm from 0, then six external ones.
fn axis(language: Language, k: usize) -> String {
    match (language, k) {
        (Language::Rapid, ..6) => format!("rax_{}", k + 1),
        (Language::Rapid, _) => format!("eax_{}", char::from(b'a' + (k - 6) as u8)),
        (Language::Krl, ..6) => format!("A{}", k + 1),
        (_, ..6) => format!("J{}", k + 1),
        _ => format!("E{}", k - 5),
    }
}

/// The joints that a controller's program declares, row by row, in deg: `name`, the six joints, the external axes.
pub(super) struct ListedRows {
    /// `name` and the axes, then the positions, each with the line at which it stands.
    rows: Vec<(u64, Vec<String>)>,
    /// How many poses were left out.
    poses: usize,
    next: usize,
}

impl ListedRows {
    /// Reads a program from first byte to last.
    pub(super) fn open(source: impl Read, label: &str, language: Language) -> Result<Self> {
        let mut bytes = Vec::new();
        // One byte more than may be tells that there are too many.
        source
            .take(MOST_BYTES as u64 + 1)
            .read_to_end(&mut bytes)
            .map_err(|error| failed(label, &error))?;
        let list = joint_list(&bytes, language).map_err(|notes| {
            let fault = |note: crate::program::Note| {
                let place = format!("{label}:{}:{}", note.line, note.column);
                Fault::new(place, note.message)
            };
            Error::Data(notes.into_iter().map(fault).collect())
        })?;
        if list.rows.is_empty() {
            return Err(Error::data(label, none(&list, language)));
        }
        // An axis that no position has makes no column.
        let has = |k: &usize| {
            let mut rows = list.rows.iter();
            rows.any(|row| row.external.get(*k).is_some_and(Option::is_some))
        };
        let used: Vec<usize> = (0..6).filter(has).collect();
        let axes = (0..6).chain(used.iter().map(|k| 6 + k));
        let names = axes.map(|k| axis(language, k));
        let mut rows = vec![(1, std::iter::once("name".into()).chain(names).collect())];
        rows.extend(list.rows.iter().map(|row| {
            let external = used.iter().map(|k| row.external[*k]);
            let numbers = row.joints.iter().map(|joint| Some(*joint)).chain(external);
            let cells =
                numbers.map(|number| number.as_ref().map_or_else(String::new, f64::to_string));
            let cells = std::iter::once(row.name.clone()).chain(cells);
            (row.line as u64, cells.collect())
        }));
        Ok(Self {
            rows,
            poses: list.poses,
            next: 0,
        })
    }
}

/// That a program declares no joints, and how it would.
fn none(list: &JointList, language: Language) -> String {
    let example = match language {
        Language::Krl => "DECL E6AXIS XP1={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}",
        Language::Fanuc => "P[1]{ GP1: UF : 0, UT : 1, J1= 0.000 deg, ... J6= 0.000 deg };",
        Language::UrScript => "wp1_q = [0.0, -1.57, 1.57, 0.0, 1.57, 0.0]",
        Language::Rapid => "CONST jointtarget p10:=[[0,-10,20,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
    };
    let poses = match list.poses {
        0 => String::new(),
        poses => format!(" ({} without joints)", counted(poses, "pose")),
    };
    format!("declares no joint position{poses}; allowed: declarations such as `{example}`")
}

impl RecordReader for ListedRows {
    fn next(&mut self, record: &mut Record) -> Result<bool> {
        let Some((line, cells)) = self.rows.get(self.next) else {
            return Ok(false);
        };
        self.next += 1;
        record.begin(*line);
        cells.iter().for_each(|cell| record.push(cell.as_bytes()));
        Ok(true)
    }
    /// The line of the last row handed out.
    fn lines(&self) -> u64 {
        let last = self.next.checked_sub(1).filter(|last| *last > 0);
        last.map_or(0, |last| self.rows[last].0)
    }
    fn bytes(&self) -> u64 {
        self.next as u64
    }
    fn remark(&self) -> Option<String> {
        let poses = self.poses;
        (poses > 0).then(|| format!("{} without joints left out", counted(poses, "pose")))
    }
}
