//! Targets in delimited text: read in batches, every byte kept but the numbers of joints; what is known of each is appended.
//!
//! Numbers with a fixed count of decimals, many a microsecond.

use super::columns::{FarTurned, TargetColumns, TargetRow};
use super::{Layout, Unreached};
use crate::compensate::{CommandTarget, CorrectedCommand, Corrector};
use crate::description::JointKind;
use crate::error::{Error, Fault, Result};
use crate::raw::{self, Delimiter, unquoted_text};
use crate::units::Unit;
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::{BufRead, Read, Write};
use std::ops::Range;

/// Rows held in memory at a time.
const BATCH: usize = 1 << 13;

/// Rows that one thread writes at a time.
const CHUNK: usize = 256;

/// Faults told of one file.
const FAULTS: usize = 20;

/// Bytes of a line; a device that never ends a line must not fill the memory.
const LONGEST: u64 = 16 << 20;

/// Decimals of an angle in deg and of a length in mm: 1e-7 deg is 0.004 um at 2.5 m.
const DECIMALS: usize = 7;

/// Reads targets from `input` to its end and writes them corrected.
pub(crate) fn stream(
    input: &mut dyn BufRead,
    output: &mut dyn Write,
    layout: &Layout,
    corrector: &mut Corrector,
) -> Result<Unreached> {
    let (mut unreached, mut turned) = (Unreached::default(), FarTurned::default());
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
    let body_names = body.trim_start_matches('\u{feff}');
    let names: Vec<String> = names(body_names, delimiter, layout.place, number)?
        .into_iter()
        .map(|field| field.1.into_owned())
        .collect();
    layout.refused(&names)?;
    let columns = TargetColumns::read(layout.place, &names, layout.robot, layout.units)?;
    let mut joints: Vec<(usize, usize, Unit)> = columns
        .joints
        .iter()
        .enumerate()
        .map(|(joint, (index, unit))| (*index, joint, *unit))
        .collect();
    joints.sort_unstable_by_key(|(index, ..)| *index);
    let table = TextTable {
        layout,
        columns: &columns,
        joints,
        delimiter,
    };
    // Written with the first rows: a fault among them leaves nothing half done.
    head.push_str(&format!(
        "{body}{}{ending}",
        table.appended_names(corrector.has_uncertainty())
    ));
    let mut block = Block::default();
    loop {
        let first = number + 1;
        block.fill(input, layout.place)?;
        let lines: Vec<&str> = block.lines()?;
        number += lines.len();
        if lines.is_empty() {
            put(output, &head)?;
            return match output.flush() {
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    Err(refused(&error))
                }
                _ => Ok(unreached),
            };
        }
        let parsed: Vec<Result<Option<(CommandTarget, Spans)>, String>> = lines
            .par_iter()
            .map(|line| {
                if line.trim().is_empty() {
                    Ok(None)
                } else {
                    table.target(line).map(Some)
                }
            })
            .collect();
        let faults: Vec<Fault> = (parsed.iter().enumerate())
            .filter_map(|(k, row)| {
                Some(Fault::new(
                    format!("{}:{}", layout.place, first + k),
                    row.as_ref().err()?,
                ))
            })
            .take(FAULTS)
            .collect();
        if !faults.is_empty() {
            return Err(Error::Data(faults));
        }
        let (mut targets, mut spans) = (
            Vec::with_capacity(lines.len()),
            Vec::with_capacity(lines.len()),
        );
        for (k, row) in parsed.into_iter().filter_map(Result::ok).enumerate() {
            let (target, span) = row.unzip();
            if let Some(target) = &target {
                turned.count(
                    || format!("{}:{}", layout.place, first + k),
                    target,
                    layout.robot,
                );
            }
            targets.extend(target);
            spans.push(span);
        }
        if let Some(fault) = turned.fault(&columns) {
            return Err(Error::Data(vec![fault]));
        }
        let mut answers = corrector.batch(targets).into_iter();
        let rows: Vec<(&str, Option<(Spans, CorrectedCommand)>)> = lines
            .into_iter()
            .zip(spans)
            .map(|(line, spans)| (line, spans.and_then(|spans| Some((spans, answers.next()?)))))
            .collect();
        for (k, answer) in rows
            .iter()
            .enumerate()
            .filter_map(|(k, (_, answered))| Some((k, &answered.as_ref()?.1)))
        {
            if answer.q.is_none() {
                unreached.push(
                    || format!("{}:{}", layout.place, first + k),
                    &answer.remark(),
                );
            }
        }
        let written: Vec<String> = rows
            .par_chunks(CHUNK)
            .map(|rows| table.lines(rows))
            .collect();
        for text in std::iter::once(&std::mem::take(&mut head)).chain(&written) {
            if !put(output, text)? {
                return Ok(unreached);
            }
        }
    }
}

/// Lines of the input as they stand there, a batch at a time.
#[derive(Default)]
struct Block {
    bytes: Vec<u8>,
    ends: Vec<usize>,
    place: String,
}

impl Block {
    /// Reads the next batch; none at the end of the input.
    fn fill(&mut self, input: &mut dyn BufRead, place: &str) -> Result<()> {
        self.bytes.clear();
        self.ends.clear();
        place.clone_into(&mut self.place);
        while self.ends.len() < BATCH {
            if read_line(input, &mut self.bytes, place)? == 0 {
                break;
            }
            self.ends.push(self.bytes.len());
        }
        Ok(())
    }

    fn lines(&self) -> Result<Vec<&str>> {
        let text = std::str::from_utf8(&self.bytes)
            .map_err(|_| Error::data(&*self.place, "is no text in UTF-8"))?;
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        Ok(starts
            .zip(&self.ends)
            .map(|(start, end)| &text[start..*end])
            .collect())
    }
}

fn refused(error: &std::io::Error) -> Error {
    Error::store("output", format!("cannot be written: {error}"))
}

/// Writes; false where the reader has gone away, which is no fault.
fn put(output: &mut dyn Write, text: &str) -> Result<bool> {
    match output.write_all(text.as_bytes()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(refused(&error)),
    }
}

/// Appends the next line; gives its bytes, 0 at the end of the input.
fn read_line(input: &mut dyn BufRead, bytes: &mut Vec<u8>, place: &str) -> Result<usize> {
    let read = input.take(LONGEST).read_until(b'\n', bytes);
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
    Ok(read)
}

fn next(input: &mut dyn BufRead, place: &str) -> Result<Option<String>> {
    let mut bytes = Vec::new();
    if read_line(input, &mut bytes, place)? == 0 {
        return Ok(None);
    }
    String::from_utf8(bytes)
        .map(Some)
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

/// A table in memory.
pub(super) struct TableText<'t> {
    pub(crate) delimiter: char,
    pub(crate) header: &'t str,
    pub(crate) names: Vec<TextField<'t>>,
    /// With their numbers, from 1.
    pub(crate) rows: Vec<(usize, &'t str)>,
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

/// The fields of a header.
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

/// Where a line's joints stand, in the order of the line, and whether its numbers have a comma.
struct Spans {
    joints: Vec<Range<usize>>,
    comma: bool,
}

struct TextTable<'a> {
    layout: &'a Layout<'a>,
    columns: &'a TargetColumns,
    /// Column, joint, unit; in the order of the columns.
    joints: Vec<(usize, usize, Unit)>,
    delimiter: char,
}

impl TextTable<'_> {
    /// Header of what is appended, with its delimiters.
    fn appended_names(&self, sigma: bool) -> String {
        let mut names = Vec::new();
        if self.columns.joints.is_empty() {
            names.extend(
                self.layout
                    .robot
                    .joints
                    .iter()
                    .enumerate()
                    .map(|(j, joint)| format!("q{}_{}", j + 1, own_unit(joint.kind).symbol())),
            );
        }
        if !self.layout.plain {
            names.extend(["uncorrected_mm", "residual_mm", "iterations"].map(String::from));
            names.extend(
                ["sigma_mm", "u95_mm"]
                    .into_iter()
                    .filter(|_| sigma)
                    .map(String::from),
            );
            names.push("remark".into());
        }
        names
            .iter()
            .map(|name| format!("{}{name}", self.delimiter))
            .collect()
    }

    fn target(&self, line: &str) -> Result<(CommandTarget, Spans), String> {
        let (body, _) = split_ending(line);
        let cells = fields(body, self.delimiter)?;
        let row = row(&cells, self.delimiter, self.columns, self.layout)?;
        let comma = self.delimiter != ','
            && body.contains(',')
            && cells.iter().any(|(_, text)| is_comma_number(text));
        let joints = self
            .joints
            .iter()
            .map(|(index, ..)| cells[*index].0.clone())
            .collect();
        Ok((
            row.target(self.columns, self.layout)?,
            Spans { joints, comma },
        ))
    }

    /// Lines with their targets' results; lines without one as they are.
    fn lines(&self, rows: &[(&str, Option<(Spans, CorrectedCommand)>)]) -> String {
        let mut out = String::with_capacity(rows.iter().map(|(line, _)| line.len() + 64).sum());
        for (line, answered) in rows {
            match answered {
                Some((spans, answer)) => self.line(&mut out, line, spans, answer),
                None => out.push_str(line),
            }
        }
        out
    }

    fn line(&self, out: &mut String, line: &str, spans: &Spans, answer: &CorrectedCommand) {
        let (body, ending) = split_ending(line);
        let point = if spans.comma { ',' } else { '.' };
        let mut at = 0;
        for (range, (_, joint, unit)) in spans.joints.iter().zip(&self.joints) {
            out.push_str(&body[at..range.start]);
            if let Some(q) = &answer.q {
                push_decimal(out, unit.from_si(q[*joint]), decimals(*unit), point);
            }
            at = range.end;
        }
        out.push_str(&body[at..]);
        let mut append = |value: Option<f64>, decimals: usize| {
            out.push(self.delimiter);
            if let Some(value) = value {
                push_decimal(out, value, decimals, point);
            }
        };
        if self.columns.joints.is_empty() {
            for (j, joint) in self.layout.robot.joints.iter().enumerate() {
                let unit = own_unit(joint.kind);
                append(
                    answer.q.as_ref().map(|q| unit.from_si(q[j])),
                    decimals(unit),
                );
            }
        }
        if !self.layout.plain {
            append(Some(answer.uncorrected * 1e3), 4);
            append(Some(answer.residual * 1e3), 6);
            append(Some(answer.iterations as f64), 0);
            if let Some(known) = answer.uncertainty {
                append(Some(known.sigma * 1e3), 4);
                append(Some(known.u95 * 1e3), 4);
            }
            let remark = answer.remark();
            let quote = if remark.contains(self.delimiter) {
                "\""
            } else {
                ""
            };
            out.push(self.delimiter);
            out.extend([quote, &remark, quote]);
        }
        out.push_str(ending);
    }
}

fn own_unit(kind: JointKind) -> Unit {
    if kind == JointKind::Revolute {
        Unit::Degree
    } else {
        Unit::Millimetre
    }
}

fn decimals(unit: Unit) -> usize {
    match unit {
        Unit::Radian | Unit::Metre => DECIMALS + 2,
        _ => DECIMALS,
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
    for (index, role) in &columns.roles {
        let (range, text) = &cells[*index];
        let (column, field) = (range.start + 1, index + 1);
        let value = parse(text, delimiter)
            .map_err(|()| format!("column {column}: field {field} is `{text}`, no number"))?;
        if let Some(value) = value {
            if let Some(message) = role.fault(value) {
                return Err(format!("column {column}: field {field}: {message}"));
            }
            row.take(*role, value, layout.robot.joints.len());
        } else if role.is_needed() {
            return Err(format!("column {column} is empty"));
        }
    }
    Ok(row)
}

/// A number, or none where the field is empty.
pub(super) fn parse(text: &str, delimiter: char) -> Result<Option<f64>, ()> {
    if text.is_empty() {
        return Ok(None);
    }
    let value = match text.parse::<f64>() {
        Ok(value) => value,
        Err(_) if delimiter != ',' && is_comma_number(text) => {
            text.replacen(',', ".", 1).parse().map_err(|_| ())?
        }
        Err(_) => return Err(()),
    };
    if value.is_finite() {
        Ok(Some(value))
    } else {
        Err(())
    }
}

/// Above this (2^53) whole numbers are no longer exact in f64.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Appends `value` with so many decimals (at most 15), after `point` (ASCII); rounded to the nearest.
pub(super) fn push_decimal(out: &mut String, value: f64, decimals: usize, point: char) {
    let scaled = (value.abs() * 10f64.powi(decimals as i32)).round_ties_even();
    if scaled.is_nan() || scaled >= EXACT || decimals > 15 {
        let text = format!("{value:.decimals$}");
        out.extend(text.chars().map(|c| if c == '.' { point } else { c }));
        return;
    }
    let (mut rest, negative) = (scaled as u64, value < 0.0 && scaled > 0.0);
    // From the last digit to the first, at least one before the point.
    let mut text = [b'0'; 24];
    let mut at = text.len();
    let mut put = |byte: u8| {
        at -= 1;
        text[at] = byte;
    };
    let mut count = 0;
    while rest > 0 || count <= decimals {
        if count == decimals && decimals > 0 {
            put(point as u8);
        }
        put(b'0' + (rest % 10) as u8);
        (rest, count) = (rest / 10, count + 1);
    }
    if negative {
        put(b'-');
    }
    out.extend(std::str::from_utf8(&text[at..]));
}

#[cfg(test)]
mod tests {
    use super::push_decimal;

    #[test]
    fn a_number_is_written_to_half_a_unit_of_its_last_decimal() {
        let mut seed = 1u64;
        for _ in 0..20_000 {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let value = (seed >> 11) as f64 / (1u64 << 53) as f64 * 400.0 - 200.0;
            for decimals in [0, 4, 7, 9] {
                let mut text = String::new();
                push_decimal(&mut text, value, decimals, '.');
                let whole: f64 = text.parse().expect("a number");
                // Half a unit of the last place and a rounding of the product.
                assert!(
                    (whole - value).abs() <= 0.500_1 * 10f64.powi(-(decimals as i32)),
                    "{value} {text}"
                );
                assert_eq!(text.len(), format!("{whole:.decimals$}").len());
            }
        }
        let write = |value, decimals, point| {
            let mut text = String::new();
            push_decimal(&mut text, value, decimals, point);
            text
        };
        assert_eq!(write(-12.5, 3, ','), "-12,500");
        assert_eq!(
            (
                write(-1e-9, 4, '.'),
                write(0.05, 1, '.'),
                write(3.0, 0, '.')
            ),
            ("0.0000".into(), "0.0".into(), "3".into())
        );
        assert_eq!(
            (write(1e30, 2, ',').len(), write(f64::NAN, 2, '.')),
            (34, "NaN".into())
        );
    }
}
