//! Recordings of drives: tables with a column for each joint or with a list a row, commands in the same file or in one of their own.

use super::DiagnoseDrives;
use crate::error::{Error, Fault, Result, did_you_mean, listed};
use crate::ingest::{TableLayout, records};
use crate::raw::{self, DecimalMark, NumberFault, Record};
use crate::{Context, OpenedInput, RawFile};
use std::ops::Range;

/// What was read of one.
pub(super) struct Rows {
    /// s.
    pub(super) time: Vec<f64>,
    /// Of each wanted quantity `rows x joints`, in the columns' unit.
    pub(super) values: Vec<Vec<f64>>,
    /// Rows of each trajectory.
    pub(super) runs: Vec<Range<usize>>,
    /// Rows of one usage, with what that is.
    pub(super) usages: Vec<(Range<usize>, Option<String>)>,
}

impl Rows {
    /// Leaves out the first rows.
    pub(super) fn skip(&mut self, rows: usize, joints: usize) {
        self.time.drain(..rows);
        for values in &mut self.values {
            values.drain(..rows * joints);
        }
        let earlier =
            |range: &Range<usize>| range.start.saturating_sub(rows)..range.end.saturating_sub(rows);
        self.runs
            .iter_mut()
            .for_each(|range| *range = earlier(range));
        self.runs.retain(|range| !range.is_empty());
        for (range, _) in &mut self.usages {
            *range = earlier(range);
        }
    }
}

/// Fails where a clock does not rise.
pub(super) fn must_rise(label: &str, time: &[f64]) -> Result<()> {
    match time.windows(2).position(|pair| pair[1] <= pair[0]) {
        None => Ok(()),
        Some(row) => {
            let (before, after) = (time[row], time[row + 1]);
            let message =
                format!("time {after} s does not come after {before} s; times of commands rise");
            Err(Error::data(format!("{label}:{}", row + 3), message))
        }
    }
}

/// Where the joints of a quantity are.
enum Cells {
    Each(Vec<usize>),
    /// In lists, as `[0.1, 0.2]`.
    List(usize),
}

/// Whether a column's name stands for one column of each joint.
fn is_of_each(column: &str) -> bool {
    column.contains("{j}") || column.contains("{name}")
}

/// A joint's name without the ending by which robot files tell joints from links.
pub fn short(name: &str) -> &str {
    name.strip_suffix("_joint").unwrap_or(name)
}

fn of_joint(column: &str, joint: usize, name: &str) -> String {
    let column = column.replace("{j}", &(joint + 1).to_string());
    column.replace("{name}", name)
}

/// The rows of a file with the quantities `wanted`, a column each, and its name for messages. Fails with every column that is not there, or
/// with the first cell that is no number.
pub(super) fn rows(
    file: &RawFile,
    settings: &DiagnoseDrives,
    names: &[String],
    wanted: &[&str],
    context: &Context,
) -> Result<(String, Rows)> {
    let OpenedInput { label, reader, .. } = context.services.open(file)?;
    let columns = &settings.columns;
    let layout = TableLayout {
        text: settings.text.layout()?,
        decimal: settings.text.decimal,
        ..TableLayout::default()
    };
    let (label, mut reader) = records(reader, &label, layout)?;
    let (decimal, below) = match reader.obeys_layout() {
        true => (settings.text.decimal, settings.text.skip_below_header),
        false => (DecimalMark::Point, 0),
    };
    let mut record = Record::default();
    if !reader.next(&mut record)? {
        return Err(Error::data(
            label,
            "is empty; expected a header and rows below it",
        ));
    }
    let head = record.cells();
    for _ in 0..below {
        reader.next(&mut record)?;
    }
    let find = |name: &str| head.iter().position(|column| column == name);
    let mut faults = Vec::new();
    let mut needed = |name: String| {
        find(&name).unwrap_or_else(|| {
            let hint = did_you_mean(&name, head.iter().map(String::as_str));
            let all: Vec<&str> = head.iter().map(String::as_str).collect();
            let message = format!(
                "no column `{name}`{hint} (columns: {}); name others in `columns`",
                listed(&all)
            );
            faults.push(Fault::new(&label, message));
            0
        })
    };
    let time = needed(columns.time.clone());
    let cells: Vec<Cells> = wanted
        .iter()
        .map(|column| match is_of_each(column) {
            true => {
                let joints = names.iter().enumerate();
                let of = |(joint, name): (usize, &String)| {
                    let whole = of_joint(column, joint, name);
                    let short = of_joint(column, joint, short(name));
                    needed(if find(&whole).is_none() && find(&short).is_some() {
                        short
                    } else {
                        whole
                    })
                };
                Cells::Each(joints.map(of).collect())
            }
            // Lists in columns of a file of columns are a column for each number.
            false if find(column).is_none() && find(&format!("{column}[1]")).is_some() => {
                let of = |k| needed(format!("{column}[{k}]"));
                Cells::Each((1..=names.len()).map(of).collect())
            }
            false => Cells::List(needed((*column).to_string())),
        })
        .collect();
    Error::if_data(faults)?;
    // What a list has beyond the joints (a gripper) is not of the arm.
    let of_columns = |column: &&&str| column.contains("{j}") && !column.ends_with("[{j}]");
    for column in wanted.iter().filter(of_columns) {
        let more = of_joint(column, names.len(), "");
        if find(&more).is_some() {
            let (n, most) = (names.len(), names.len() + 1);
            return Err(Error::data(
                label,
                format!(
                    "has a column of joint {most} (`{more}`), the drives file names {n} joints"
                ),
            ));
        }
    }
    let (trajectory, usage) = (find(&columns.trajectory), find(&columns.usage));
    let mut out = Rows {
        time: Vec::new(),
        values: vec![Vec::new(); wanted.len()],
        runs: Vec::new(),
        usages: Vec::new(),
    };
    let by = columns.time_unit.seconds();
    let mut last: Option<Option<String>> = None;
    let mut row = 0;
    while reader.next(&mut record)? {
        let place = format!("{label}:{}", record.line);
        if let Some((_, message)) = &record.fault {
            return Err(Error::data(&place, message));
        }
        let number = |column: usize| of_cell(&record, &head, column, decimal, &place);
        out.time.push(by * number(time)?);
        for (cells, values) in cells.iter().zip(&mut out.values) {
            match cells {
                Cells::Each(all) => {
                    for column in all {
                        values.push(number(*column)?);
                    }
                }
                Cells::List(column) => {
                    values.extend(of_list(&record, &head, *column, names.len(), &place)?);
                }
            }
        }
        let of = |column: Option<usize>| column.map(|column| cell(&record, column).to_string());
        let (here, use_of_row) = (of(trajectory), of(usage));
        if last.as_ref() != Some(&here) {
            out.runs.push(row..row);
            last = Some(here);
        }
        if out
            .usages
            .last()
            .is_none_or(|(_, usage)| *usage != use_of_row)
        {
            out.usages.push((row..row, use_of_row));
        }
        row += 1;
        if let (Some(run), Some((rows, _))) = (out.runs.last_mut(), out.usages.last_mut()) {
            (run.end, rows.end) = (row, row);
        }
    }
    Ok((label, out))
}

fn cell(record: &Record, column: usize) -> &str {
    std::str::from_utf8(record.field(column)).unwrap_or_default()
}

fn finite(text: &str) -> Option<f64> {
    text.trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
}

fn of_cell(
    record: &Record,
    head: &[String],
    column: usize,
    decimal: DecimalMark,
    place: &str,
) -> Result<f64> {
    let cell = cell(record, column).trim();
    raw::number(cell.as_bytes(), decimal).map_err(|fault| {
        let name = &head[column];
        let mark = match fault {
            NumberFault::Comma => " with a decimal point, or `text: {decimal: comma}`",
            NumberFault::Point => " with a decimal comma, as `text` says",
            _ => "",
        };
        let message = format!("column `{name}` holds `{cell}`; expected a finite number{mark}");
        Error::data(place, message)
    })
}

/// The first `joints` numbers of a list; a gripper's may follow.
fn of_list(
    record: &Record,
    head: &[String],
    column: usize,
    joints: usize,
    place: &str,
) -> Result<Vec<f64>> {
    let (cell, name) = (cell(record, column), &head[column]);
    let inside = cell
        .strip_prefix('[')
        .and_then(|cell| cell.strip_suffix(']'));
    let inside = inside.ok_or_else(|| {
        let message = format!(
            "column `{name}` holds `{cell}`; expected a list as `[0.1, 0.2]`, or in `columns` a name with `{{j}}` (joints from 1) or `{{name}}`"
        );
        Error::data(place, message)
    })?;
    let numbers: Option<Vec<f64>> = inside
        .split([',', ' '])
        .filter(|part| !part.is_empty())
        .map(finite)
        .collect();
    let numbers = numbers.filter(|numbers| numbers.len() >= joints);
    numbers
        .map(|numbers| numbers[..joints].to_vec())
        .ok_or_else(|| {
            let message = format!(
                "column `{name}` holds `{cell}`; expected finite numbers of at least {joints} joints, which the drives file names"
            );
            Error::data(place, message)
        })
}

/// For each time of the angles the row of the command that holds then: the last that was sent by it. Also how many times are before the first.
pub(super) fn held(sent: &[f64], at: &[f64]) -> (Vec<usize>, usize) {
    // Stamps of one instant may differ in the last digits.
    let by = |time: f64| sent.partition_point(|one| *one <= time + 1e-6);
    let before = at.iter().take_while(|time| by(**time) == 0).count();
    let rows = at.iter().map(|time| by(*time).saturating_sub(1));
    (rows.collect(), before)
}
