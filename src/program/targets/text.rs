//! Targets in delimited text: read in batches, every byte kept but the numbers of joints; what is known of each is appended.

use super::columns::{TargetColumns, TargetRow};
use super::{Appended, BATCH, LIMIT, Layout, TargetTable, Unreached, corrected};
use crate::compensate::{CommandTarget, CorrectedCommand, Corrector};
use crate::error::{Error, Fault, Result};
use crate::raw::{self, DecimalMark, Delimiter, NumberFault, number, unquoted_text};
use crate::units::Unit;
use rayon::prelude::*;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{BufRead, ErrorKind, Read, Write};
use std::ops::Range;

/// Rows that one thread writes at a time.
const CHUNK: usize = 256;

/// Bytes of a line; a device that never ends a line must not fill the memory.
const LONGEST: u64 = 16 << 20;

/// Decimals of an angle in deg and of a length in mm: 1e-7 deg is 0.004 um at 2.5 m.
const DECIMALS: usize = 7;

/// Reads targets from `input` to its end and writes them corrected.
pub fn stream(
    input: &mut dyn BufRead,
    output: &mut dyn Write,
    layout: &Layout,
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let (mut number, mut head) = (0, String::new());
    let header = loop {
        let Some(line) = next(input, layout.place)? else {
            return Err(Error::data(
                layout.place,
                "is empty; expected a header line and targets",
            ));
        };
        number += 1;
        if !line.trim().is_empty() {
            break line;
        }
        head.push_str(&line);
    };
    let delimiter = delimiter(&header);
    let (body, ending) = split_ending(&header);
    let names = names(
        body.trim_start_matches('\u{feff}'),
        delimiter,
        layout.place,
        number,
    )?;
    let columns = layout.columns(&texts(&names))?;
    let joints = columns.joints.iter().enumerate();
    let mut joints: Vec<(usize, usize, Unit)> = joints
        .map(|(joint, (index, unit))| (*index, joint, *unit))
        .collect();
    joints.sort_unstable_by_key(|(index, ..)| *index);
    let appended = layout.appended(&columns, Unit::Degree, corrector.has_uncertainty());
    // Written with the first rows: a fault among them leaves nothing half done.
    head.push_str(body);
    for column in &appended {
        head.extend([delimiter.to_string(), column.name()]);
    }
    head.push_str(ending);
    let form = TextForm {
        layout,
        columns: &columns,
        appended,
        joints,
        delimiter,
    };
    let mut table = TextTable {
        input,
        output,
        form,
        number,
        head,
        comma: None,
        rows: Vec::new(),
    };
    let unreached = corrected(&mut table, &columns, layout, corrector)?;
    put(table.output, &table.head)?;
    match table.output.flush() {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(refused(&error)),
        _ => Ok(unreached),
    }
}

fn refused(error: &std::io::Error) -> Error {
    Error::store("output", format!("cannot be written: {error}"))
}

/// Writes; false where the reader has gone away, which is no fault.
fn put(output: &mut dyn Write, text: &str) -> Result<bool> {
    match output.write_all(text.as_bytes()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(refused(&error)),
    }
}

/// The next line as it stands there; none at the end of the input.
fn next(input: &mut dyn BufRead, place: &str) -> Result<Option<String>> {
    let mut bytes = Vec::new();
    let read = input.take(LONGEST).read_until(b'\n', &mut bytes);
    let read = read.map_err(|error| Error::store(place, format!("cannot be read: {error}")))?;
    if read as u64 == LONGEST {
        return Err(Error::data(
            place,
            format!(
                "has a line of more than {} MB; expected a table of targets",
                LONGEST >> 20
            ),
        ));
    }
    let line = String::from_utf8(bytes);
    line.map(|line| Some(line).filter(|line| !line.is_empty()))
        .map_err(|_| Error::data(place, "is no text in UTF-8"))
}

/// Where a field stands in its line, and its text without quotes.
pub(super) type TextField<'t> = (Range<usize>, Cow<'t, str>);

/// The fields of a line. Fails where its quotes are not well formed.
pub(super) fn fields(line: &str, delimiter: char) -> Result<Vec<TextField<'_>>, String> {
    let (places, fault) = raw::fields(line, Delimiter::Byte(delimiter as u8));
    match fault {
        Some((at, why)) => Err(format!("column {}: {why}", at + 1)),
        None => Ok(places
            .into_iter()
            .map(|place| (place.clone(), unquoted_text(&line[place])))
            .collect()),
    }
}

/// The texts of fields.
pub(super) fn texts(fields: &[TextField]) -> Vec<String> {
    fields.iter().map(|field| field.1.to_string()).collect()
}

pub(super) struct TableText<'t> {
    pub delimiter: char,
    pub header: &'t str,
    pub names: Vec<TextField<'t>>,
    /// With their numbers, from 1.
    pub rows: Vec<(usize, &'t str)>,
}

/// Takes a table apart; fails where it has no header, and then `expected` something.
pub(super) fn table<'t>(text: &'t str, place: &str, expected: &str) -> Result<TableText<'t>> {
    let mut lines = (1..)
        .zip(text.trim_start_matches('\u{feff}').lines())
        .filter(|(_, line)| !line.trim().is_empty());
    let Some((number, header)) = lines.next() else {
        return Err(Error::data(place, format!("is empty; expected {expected}")));
    };
    let delimiter = delimiter(header);
    Ok(TableText {
        delimiter,
        header,
        names: names(header, delimiter, place, number)?,
        rows: lines.collect(),
    })
}

fn names<'t>(
    header: &'t str,
    delimiter: char,
    place: &str,
    number: usize,
) -> Result<Vec<TextField<'t>>> {
    fields(header, delimiter).map_err(|message| Error::data(format!("{place}:{number}"), message))
}

/// A line and its line ending.
fn split_ending(line: &str) -> (&str, &str) {
    let body = line.trim_end_matches(['\n', '\r']);
    (body, &line[body.len()..])
}

/// What separates most in the header.
pub(super) fn delimiter(header: &str) -> char {
    let count = |c: char| header.matches(c).count();
    [';', '\t', ',']
        .into_iter()
        .filter(|c| count(*c) > 0)
        .max_by_key(|c| count(*c))
        .unwrap_or(',')
}

/// Where a line's joints stand, in the order of the line, and whether its numbers have a decimal comma, where it has decimals.
struct Spans {
    joints: Vec<Range<usize>>,
    comma: Option<bool>,
}

struct TextTable<'a> {
    input: &'a mut dyn BufRead,
    output: &'a mut dyn Write,
    form: TextForm<'a>,
    /// Lines that were read.
    number: usize,
    /// What is written before the next rows.
    head: String,
    /// Whether the first line with decimals has a comma: lines without any are written as it is, so that a table has one mark.
    comma: Option<bool>,
    /// The lines that were read last; blank ones hold no target.
    rows: Vec<(String, Option<Spans>)>,
}

impl TargetTable for TextTable<'_> {
    fn read(&mut self) -> Result<Option<Vec<(usize, CommandTarget)>>> {
        let first = self.number + 1;
        let lines = std::iter::from_fn(|| next(self.input, self.form.layout.place).transpose());
        let lines = lines.take(BATCH).collect::<Result<Vec<String>>>()?;
        self.number += lines.len();
        if lines.is_empty() {
            return Ok(None);
        }
        let form = &self.form;
        let read = lines.par_iter().map(|line| {
            let is_blank = line.trim().is_empty();
            (!is_blank).then(|| form.target(line)).transpose()
        });
        let (mut faults, mut targets) = (Vec::new(), Vec::with_capacity(lines.len()));
        let read: Vec<Result<Option<(CommandTarget, Spans)>, String>> = read.collect();
        let mut read_here = read.iter().flatten().flatten();
        let found = read_here.find_map(|(_, spans)| spans.comma);
        self.comma = self.comma.or(found);
        self.rows.clear();
        for ((number, line), read) in (first..).zip(lines).zip(read) {
            match read {
                Ok(read) => {
                    let (target, spans) = read.unzip();
                    targets.extend(target.map(|target| (number, target)));
                    self.rows.push((line, spans));
                }
                Err(message) if faults.len() < LIMIT => {
                    faults.push(Fault::new(self.place(number), message));
                }
                Err(_) => {}
            }
        }
        Error::if_data(faults).map(|()| Some(targets))
    }
    fn place(&self, number: usize) -> String {
        format!("{}:{number}", self.form.layout.place)
    }
    fn write(&mut self, answers: &[CorrectedCommand]) -> Result<bool> {
        let form = &self.form;
        let mut answers = answers.iter();
        let rows = self.rows.iter().map(|(line, spans)| {
            let spans = spans.as_ref();
            let answered = spans.and_then(|spans| Some((spans, answers.next()?)));
            (line.as_str(), answered)
        });
        let rows: Vec<(&str, Option<(&Spans, &CorrectedCommand)>)> = rows.collect();
        let written: Vec<String> = rows
            .par_chunks(CHUNK)
            .map(|rows| form.lines(rows, self.comma == Some(true)))
            .collect();
        for text in std::iter::once(&std::mem::take(&mut self.head)).chain(&written) {
            if !put(self.output, text)? {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// How a table is written.
struct TextForm<'a> {
    layout: &'a Layout<'a>,
    columns: &'a TargetColumns,
    appended: Vec<Appended>,
    /// Column, joint, unit; in the order of the columns.
    joints: Vec<(usize, usize, Unit)>,
    delimiter: char,
}

impl TextForm<'_> {
    fn target(&self, line: &str) -> Result<(CommandTarget, Spans), String> {
        let (body, _) = split_ending(line);
        let cells = fields(body, self.delimiter)?;
        let row = row(&cells, self.delimiter, self.columns, self.layout)?;
        let has = |mark: char, is_so: fn(&str) -> bool| {
            body.contains(mark) && cells.iter().any(|(_, text)| is_so(text))
        };
        let comma = match self.delimiter {
            ',' => Some(false),
            _ if has(',', is_comma_number) => Some(true),
            _ => has('.', |text| {
                text.contains('.') && text.parse::<f64>().is_ok()
            })
            .then_some(false),
        };
        let joints = self.joints.iter();
        let joints = joints.map(|(index, ..)| cells[*index].0.clone()).collect();
        Ok((
            row.target(self.columns, self.layout)?,
            Spans { joints, comma },
        ))
    }

    /// Lines with their targets' results; lines without one as they are.
    fn lines(&self, rows: &[(&str, Option<(&Spans, &CorrectedCommand)>)], comma: bool) -> String {
        let mut out = String::with_capacity(rows.iter().map(|(line, _)| line.len() + 64).sum());
        for (line, answered) in rows {
            match answered {
                Some((spans, answer)) => self.line(&mut out, line, spans, comma, answer),
                None => out.push_str(line),
            }
        }
        out
    }

    fn line(
        &self,
        out: &mut String,
        line: &str,
        spans: &Spans,
        comma: bool,
        answer: &CorrectedCommand,
    ) {
        let (body, ending) = split_ending(line);
        let point = if spans.comma.unwrap_or(comma) {
            ','
        } else {
            '.'
        };
        let number = |out: &mut String, column: Appended| {
            if let Some(value) = column.number(answer) {
                push_decimal(out, value, decimals(column), point);
            }
        };
        let mut at = 0;
        for (range, (_, joint, unit)) in spans.joints.iter().zip(&self.joints) {
            out.push_str(&body[at..range.start]);
            number(out, Appended::Joint(*joint, *unit));
            at = range.end;
        }
        out.push_str(&body[at..]);
        for column in &self.appended {
            out.push(self.delimiter);
            if *column == Appended::Remark {
                push_text(out, &answer.remark(), self.delimiter);
            } else {
                number(out, *column);
            }
        }
        out.push_str(ending);
    }
}

/// Appends a text, in quotes where it holds the delimiter.
pub(super) fn push_text(out: &mut String, text: &str, delimiter: char) {
    let quote = if text.contains(delimiter) { "\"" } else { "" };
    out.extend([quote, text, quote]);
}

fn decimals(column: Appended) -> usize {
    match column {
        Appended::Joint(_, Unit::Radian | Unit::Metre) => DECIMALS + 2,
        Appended::Joint(..) => DECIMALS,
        Appended::Residual => 6,
        Appended::Iterations => 0,
        _ => 4,
    }
}

fn is_comma_number(text: &str) -> bool {
    text.contains(',') && !text.contains('.') && text.replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// The numbers of a row by its fields.
pub(super) fn row(
    cells: &[TextField],
    delimiter: char,
    columns: &TargetColumns,
    layout: &Layout,
) -> Result<TargetRow, String> {
    if cells.len() != columns.count {
        return Err(format!(
            "has {} fields, the header {}",
            cells.len(),
            columns.count
        ));
    }
    let mut row = TargetRow::default();
    for (index, role, unit) in &columns.read {
        let (range, text) = &cells[*index];
        let (column, field) = (range.start + 1, index + 1);
        let value = parse(text, delimiter)
            .map_err(|()| format!("column {column}: field {field} is `{text}`, no number"))?;
        if let Some(value) = value {
            if let Some(message) = role.fault(value) {
                return Err(format!("column {column}: field {field}: {message}"));
            }
            row.take(*role, unit.to_si(value), layout.robot.joints.len());
        } else if role.is_needed() {
            return Err(format!("column {column} is empty"));
        }
    }
    Ok(row)
}

/// A number, or none where the field is empty.
pub(super) fn parse(text: &str, delimiter: char) -> Result<Option<f64>, ()> {
    let mark = match delimiter != ',' && is_comma_number(text) {
        true => DecimalMark::Comma,
        false => DecimalMark::Point,
    };
    match number(text.as_bytes(), mark) {
        Ok(value) => Ok(Some(value)),
        Err(NumberFault::Blank) => Ok(None),
        Err(_) => Err(()),
    }
}

/// Appends `value` with so many decimals, after `point`, rounded to the nearest; no zero has a sign.
pub(super) fn push_decimal(out: &mut String, value: f64, decimals: usize, point: char) {
    let start = out.len();
    let _ = write!(out, "{value:.decimals$}");
    let text = &out[start..];
    if text.starts_with('-') && !text.contains(|digit| ('1'..='9').contains(&digit)) {
        out.remove(start);
    }
    if point != '.'
        && let Some(at) = out[start..].find('.')
    {
        out.replace_range(start + at..=start + at, point.encode_utf8(&mut [0; 4]));
    }
}
