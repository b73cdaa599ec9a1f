//! Targets in delimited text: read in batches, every byte kept but the numbers of joints; what is known of each is appended.

use super::columns::{Columns, Role, Units};
use super::correct::{Answer, Corrector, Target};
use crate::error::{Error, Fault, Result};
use crate::robot::description::{JointKind, RobotDescription};
use crate::units::Unit;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use std::io::{BufRead, Write};
use std::ops::Range;

/// Rows held in memory at a time.
const BATCH: usize = 1 << 13;

/// Faults told of one file.
const FAULTS: usize = 20;

/// Decimals of an angle in deg and of a length in mm: 1e-7 deg is 0.004 um at 2.5 m.
const DECIMALS: usize = 7;

pub(super) struct Layout<'a> {
    pub place: &'a str,
    pub robot: &'a RobotDescription,
    pub units: Units,
    /// Appends nothing: joints are replaced, all else stays.
    pub plain: bool,
    pub cartesian: bool,
}

/// Reads targets from `input` to its end and writes them corrected.
pub(super) fn stream(input: &mut dyn BufRead, output: &mut dyn Write, layout: &Layout, corrector: &mut Corrector) -> Result<()> {
    let mut number = 0;
    let header = loop {
        let Some(line) = next(input, layout.place)? else {
            return Err(Error::data(layout.place, "is empty; expected a header line and targets"));
        };
        number += 1;
        if !line.trim().is_empty() {
            break line;
        }
        put(output, &line)?;
    };
    let delimiter = delimiter(&header);
    let (body, ending) = split_ending(&header);
    let names: Vec<String> = fields(body.trim_start_matches('\u{feff}'), delimiter).into_iter().map(|field| field.1).collect();
    let columns = Columns::read(layout.place, &names, layout.robot, layout.units)?;
    let table = Sheet { layout, columns: &columns, delimiter };
    put(output, &format!("{body}{}{ending}", table.appended_names(corrector.has_uncertainty())))?;
    loop {
        let mut lines = Vec::with_capacity(BATCH);
        let first = number + 1;
        while lines.len() < BATCH {
            let Some(line) = next(input, layout.place)? else { break };
            number += 1;
            lines.push(line);
        }
        if lines.is_empty() {
            return match output.flush() {
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(refused(&error)),
                _ => Ok(()),
            };
        }
        let parsed: Vec<Result<Option<Target>, String>> =
            lines.par_iter().map(|line| if line.trim().is_empty() { Ok(None) } else { table.target(line).map(Some) }).collect();
        let faults: Vec<Fault> = (parsed.iter().enumerate())
            .filter_map(|(k, row)| Some(Fault::new(format!("{}:{}", layout.place, first + k), row.as_ref().err()?)))
            .take(FAULTS)
            .collect();
        if !faults.is_empty() {
            return Err(Error::Data(faults));
        }
        let given: Vec<Option<Target>> = parsed.into_iter().filter_map(Result::ok).collect();
        let filled: Vec<bool> = given.iter().map(Option::is_some).collect();
        let mut answers = corrector.batch(given.into_iter().flatten().collect()).into_iter();
        let pairs: Vec<(&String, Option<Answer>)> =
            lines.iter().zip(filled).map(|(line, filled)| (line, if filled { answers.next() } else { None })).collect();
        let written: Vec<String> = pairs
            .par_iter()
            .map(|(line, answer)| answer.as_ref().map_or_else(|| (*line).clone(), |a| table.line(line, a)))
            .collect();
        for line in &written {
            if !put(output, line)? {
                return Ok(());
            }
        }
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

fn next(input: &mut dyn BufRead, place: &str) -> Result<Option<String>> {
    let mut bytes = Vec::new();
    let read = input.read_until(b'\n', &mut bytes).map_err(|error| Error::store(place, format!("cannot be read: {error}")))?;
    if read == 0 {
        return Ok(None);
    }
    String::from_utf8(bytes).map(Some).map_err(|_| Error::data(place, "is no text in UTF-8"))
}

/// A line and its line ending.
fn split_ending(line: &str) -> (&str, &str) {
    let body = line.trim_end_matches(['\n', '\r']);
    (body, &line[body.len()..])
}

/// What separates most in the header.
fn delimiter(header: &str) -> char {
    let count = |c: char| header.matches(c).count();
    [';', '\t', ','].into_iter().filter(|c| count(*c) > 0).max_by_key(|c| count(*c)).unwrap_or(',')
}

/// Where each field stands, and its text without quotes.
fn fields(line: &str, delimiter: char) -> Vec<(Range<usize>, String)> {
    let mut out = Vec::new();
    let (mut start, mut quoted) = (0, false);
    let plain = |text: &str| {
        let text = text.trim();
        text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text).replace("\"\"", "\"")
    };
    for (at, c) in line.char_indices() {
        if c == '"' {
            quoted = !quoted;
        } else if c == delimiter && !quoted {
            out.push((start..at, plain(&line[start..at])));
            start = at + c.len_utf8();
        }
    }
    out.push((start..line.len(), plain(&line[start..])));
    out
}

struct Sheet<'a> {
    layout: &'a Layout<'a>,
    columns: &'a Columns,
    delimiter: char,
}

impl Sheet<'_> {
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
            names.extend(sigma.then(|| "sigma_mm".to_string()));
            names.push("remark".into());
        }
        names.iter().map(|name| format!("{}{name}", self.delimiter)).collect()
    }

    fn target(&self, line: &str) -> Result<Target, String> {
        let (body, _) = split_ending(line);
        let cells = fields(body, self.delimiter);
        if cells.len() != self.columns.count {
            return Err(format!("has {} fields, the header {}", cells.len(), self.columns.count));
        }
        let number = |index: usize| -> Result<Option<f64>, String> {
            let (range, text) = &cells[index];
            parse(text, self.delimiter)
                .map_err(|()| format!("column {}: field {} is `{text}`, no number", range.start + 1, index + 1))
        };
        let mut row = Row::default();
        for (index, role) in &self.columns.roles {
            if let Some(value) = number(*index)? {
                row.take(*role, value, self.layout.robot.joints.len());
            } else if matches!(role, Role::Joint(..) | Role::Axis(..) | Role::Quaternion(_) | Role::Turn(..)) {
                return Err(format!("column {} is empty", cells[*index].0.start + 1));
            }
        }
        row.target(self.columns, self.layout.cartesian)
    }

    fn line(&self, line: &str, answer: &Answer) -> String {
        let (body, ending) = split_ending(line);
        let cells = fields(body, self.delimiter);
        let comma = cells.iter().any(|(_, text)| self.delimiter != ',' && is_comma_number(text));
        let write = |value: f64, unit: Unit| {
            let text = format!("{:.*}", decimals(unit), unit.from_si(value));
            if comma { text.replace('.', ",") } else { text }
        };
        let mut out = String::with_capacity(line.len() + 64);
        let mut at = 0;
        let mut joints: Vec<(usize, usize, Unit)> =
            self.columns.joints.iter().enumerate().map(|(j, (index, unit))| (*index, j, *unit)).collect();
        joints.sort_unstable_by_key(|(index, ..)| *index);
        for (index, joint, unit) in joints {
            let range = &cells[index].0;
            out.push_str(&body[at..range.start]);
            out.push_str(&write(answer.q[joint], unit));
            at = range.end;
        }
        out.push_str(&body[at..]);
        let mut append = |text: &str| {
            out.push(self.delimiter);
            out.push_str(text);
        };
        if self.columns.joints.is_empty() {
            for (joint, q) in self.layout.robot.joints.iter().zip(&answer.q) {
                append(&write(*q, own_unit(joint.kind)));
            }
        }
        if !self.layout.plain {
            let mm = |value: f64, decimals: usize| {
                let text = format!("{:.decimals$}", value * 1e3);
                if comma { text.replace('.', ",") } else { text }
            };
            append(&mm(answer.uncorrected, 4));
            append(&mm(answer.residual, 6));
            append(&answer.iterations.to_string());
            if let Some(sigma) = answer.sigma {
                append(&mm(sigma, 4));
            }
            append(&if answer.remark.contains(self.delimiter) {
                format!("\"{}\"", answer.remark)
            } else {
                answer.remark.clone()
            });
        }
        out.push_str(ending);
        out
    }
}

fn own_unit(kind: JointKind) -> Unit {
    if kind == JointKind::Revolute { Unit::Degree } else { Unit::Millimetre }
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

/// A number, or none where the field is empty.
fn parse(text: &str, delimiter: char) -> Result<Option<f64>, ()> {
    if text.is_empty() {
        return Ok(None);
    }
    let value = match text.parse::<f64>() {
        Ok(value) => value,
        Err(_) if delimiter != ',' && is_comma_number(text) => text.replacen(',', ".", 1).parse().map_err(|_| ())?,
        Err(_) => return Err(()),
    };
    if value.is_finite() { Ok(Some(value)) } else { Err(()) }
}

/// The numbers of one row, by what they mean.
#[derive(Default)]
pub(super) struct Row {
    target: Target,
    point: [f64; 3],
    quaternion: [f64; 4],
    turns: [f64; 3],
}

impl Row {
    pub fn take(&mut self, role: Role, value: f64, joints: usize) {
        let put =
            |slot: &mut Option<Vec<f64>>, joint: usize, value: f64| slot.get_or_insert_with(|| vec![0.0; joints])[joint] = value;
        match role {
            Role::Joint(joint, unit) => put(&mut self.target.q, joint, unit.to_si(value)),
            Role::Axis(axis, unit) => self.point[axis] = unit.to_si(value),
            Role::Quaternion(part) => self.quaternion[part] = value,
            Role::Turn(turn, unit) => self.turns[turn] = unit.to_si(value),
            Role::Payload => self.target.payload = Some(value),
            Role::Temperature => self.target.temperature = Some(value),
            Role::Time => self.target.time = Some(value),
            Role::Direction(joint) => put(&mut self.target.direction, joint, value),
            Role::Current(joint) => put(&mut self.target.current, joint, value),
        }
    }

    pub fn target(mut self, columns: &Columns, cartesian: bool) -> Result<Target, String> {
        // Where joints are the targets, what else stands there is not the tool's place in the base frame, e.g. measured points.
        if columns.point && (cartesian || columns.joints.is_empty()) {
            self.target.point = Some(Vector3::from(self.point));
            if columns.orientation {
                self.target.rotation = Some(self.rotation()?);
            }
        }
        Ok(self.target)
    }

    fn rotation(&self) -> Result<Matrix3<f64>, String> {
        let [w, x, y, z] = self.quaternion;
        let length = Vector3::new(x, y, z).norm().hypot(w);
        if length == 0.0 {
            let [a, b, c] = self.turns;
            return Ok(turns(a, b, c));
        }
        if (length - 1.0).abs() > 1e-3 {
            return Err(format!("the quaternion has length {length:.4}, expected 1"));
        }
        Ok(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix().into_inner())
    }
}

/// A about z, then B about the new y, then C about the new x (rad): KUKA's A, B, C.
pub(super) fn turns(a: f64, b: f64, c: f64) -> Matrix3<f64> {
    Rotation3::from_euler_angles(c, b, a).into_inner()
}
