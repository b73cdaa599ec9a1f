//! A planned motion as delimited text: times and joints in even steps; what it needs of torque is appended, all else stays.

use super::columns::{ColumnRole, ReadColumn, read_columns};
use super::text::{TableText, TextField, fields, parse, table, texts};
use super::{LIMIT, text};
use crate::description::RobotDescription;
use crate::dynamics::{JudgedRow, NeededTorques, PlannedMotion};
use crate::error::{Error, Fault, Result};

/// What a step of the clock may be off, as a share of the usual step.
const UNEVEN: f64 = 0.02;
/// Decimals of torques (Nm) and currents (A).
const DECIMALS: usize = 6;

/// A column of a motion, and what its unit is in SI.
type MotionColumn = ReadColumn<f64>;

/// A file's motion, and its lines.
pub struct Trajectory<'a> {
    /// SI.
    pub motion: PlannedMotion,
    header: &'a str,
    /// With their numbers, from 1.
    lines: Vec<(usize, &'a str)>,
    delimiter: char,
    /// Mark before decimals.
    point: char,
}

impl<'a> Trajectory<'a> {
    /// Reads a motion of a robot; `place` names the text in faults. Fails with columns that are not known or missing, numbers that cannot
    /// be read, times that do not grow in even steps, and where calib wrote the torques of the text already; `force`: its columns are
    /// written anew.
    pub fn read(place: &str, text: &'a str, robot: &RobotDescription, force: bool) -> Result<Self> {
        let TableText {
            delimiter,
            header,
            names,
            rows: lines,
        } = table(text, place, "a header line and a motion")?;
        let everything = names.len();
        let kept = kept(place, &names, robot.joints.len(), force)?;
        let last = kept.checked_sub(1);
        let header = last.map_or(header, |last| &header[..names[last].0.end]);
        let columns = columns(place, &texts(&names)[..kept], robot)?;
        let mut trajectory = Self {
            motion: empty_motion(robot.joints.len(), lines.len(), &columns),
            header,
            lines,
            delimiter,
            point: '.',
        };
        for (_, line) in trajectory.lines.iter_mut().filter(|_| kept < everything) {
            // What cannot be split is told where the line is read.
            let cells = fields(line, delimiter).ok();
            let end = cells.and_then(|cells| Some(cells.get(last?)?.0.end));
            *line = end.map_or(*line, |end| &line[..end]);
        }
        trajectory.fill(place, &columns)?;
        trajectory.check_clock(place)?;
        Ok(trajectory)
    }

    /// Reads all rows.
    fn fill(&mut self, place: &str, columns: &[MotionColumn]) -> Result<()> {
        let mut faults = Vec::new();
        for (row, (number, line)) in self.lines.iter().enumerate() {
            let mut fault = |message: String| {
                if faults.len() < LIMIT {
                    faults.push(Fault::new(format!("{place}:{number}"), message));
                }
            };
            let cells = fields(line, self.delimiter).and_then(|cells| {
                let (found, expected) = (cells.len(), columns.len());
                let is_whole = found == expected;
                let message = || format!("has {found} cells, the header {expected}");
                is_whole.then_some(cells).ok_or_else(message)
            });
            let cells = match cells {
                Ok(cells) => cells,
                Err(message) => {
                    fault(message);
                    continue;
                }
            };
            for ((_, role, unit), (_, cell)) in columns.iter().zip(cells) {
                let Ok(Some(value)) = parse(&cell, self.delimiter) else {
                    fault(format!("`{cell}` is not a number"));
                    continue;
                };
                if self.delimiter != ',' && cell.contains(',') {
                    self.point = ',';
                }
                put(&mut self.motion, row, *role, unit * value);
            }
        }
        Error::if_data(faults)
    }

    /// Times must grow in even steps: derivatives are by differences of rows.
    fn check_clock(&self, place: &str) -> Result<()> {
        let time = &self.motion.time;
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual = crate::statistics::nearest(&mut steps, 0.5).unwrap_or(0.0);
        let uneven = |step: f64| (step - usual).abs() > UNEVEN * usual;
        let steps = || (1..).zip(time.windows(2).map(|pair| pair[1] - pair[0]));
        let (row, message) = if let Some(row) =
            (1..time.len()).find(|row| time[*row] <= time[row - 1])
        {
            let (now, before) = (time[row], time[row - 1]);
            (
                row,
                format!("the time does not increase: {now} s after {before} s"),
            )
        } else if let Some((row, step)) = steps().find(|(_, step)| uneven(*step)) {
            let message = format!(
                "the clock is uneven: a step of {step:.6} s, usual are {usual:.6} s; give the motion in even steps"
            );
            (row, message)
        } else {
            return Ok(());
        };
        Err(Error::data(self.place(row, place), message))
    }

    /// The lines with torques (Nm), currents (A) where `per_ampere` says what an ampere is, uncertainties (Nm) where they are known, and
    /// the remarks of each row; a row that is refused has no torques.
    pub fn written(
        &self,
        needed: &NeededTorques,
        per_ampere: Option<&[f64]>,
        rows: &[JudgedRow],
    ) -> String {
        let n = self.motion.joints;
        let (between, point) = (self.delimiter, self.point);
        let mut text = self.header.trim_end().to_string();
        for name in appended(n, per_ampere.is_some(), needed.u95.is_some()) {
            text.push(between);
            text.push_str(&name);
        }
        text.push('\n');
        for (row, ((_, line), judged)) in self.lines.iter().zip(rows).enumerate() {
            text.push_str(line.trim_end());
            let cells = n * row..n * (row + 1);
            let mut number = |value: Option<f64>| {
                text.push(between);
                if let Some(value) = value {
                    text::push_decimal(&mut text, value, DECIMALS, point);
                }
            };
            let allowed = |value: f64| (!judged.is_refused()).then_some(value);
            let torque = &needed.torque[cells.clone()];
            torque.iter().for_each(|torque| number(allowed(*torque)));
            for (torque, factor) in torque.iter().zip(per_ampere.unwrap_or_default()) {
                number(allowed(torque / factor));
            }
            let u95 = needed.u95.iter().flat_map(|all| &all[cells.clone()]);
            u95.for_each(|u95| number(Some(*u95)));
            text.push(between);
            text::push_text(&mut text, &judged.to_string(), between);
            text.push('\n');
        }
        text
    }

    /// The place of a row in its text.
    pub fn place(&self, row: usize, file: &str) -> String {
        format!("{file}:{}", self.lines[row].0)
    }
}

/// Names of the columns that are appended.
fn appended(joints: usize, currents: bool, u95: bool) -> impl Iterator<Item = String> {
    let each = move |wanted: bool, name: fn(usize) -> String| {
        (1..=joints).filter(move |_| wanted).map(name)
    };
    each(true, |joint| format!("tau{joint}_nm"))
        .chain(each(currents, |joint| format!("i{joint}_a")))
        .chain(each(u95, |joint| format!("u95_{joint}_nm")))
        .chain(std::iter::once("remark".into()))
}

/// How many columns are the person's own: all, or those before the ones that calib appended. Fails where there are such, unless `force`.
fn kept(place: &str, names: &[TextField], joints: usize, force: bool) -> Result<usize> {
    let Some(first) = names.iter().position(|field| field.1 == "tau1_nm") else {
        return Ok(names.len());
    };
    let ours = |(currents, u95)| {
        let names = names[first..].iter().map(|field| &*field.1);
        names.eq(appended(joints, currents, u95))
    };
    let written = [(true, true), (true, false), (false, true), (false, false)];
    if !written.into_iter().any(ours) {
        return Ok(names.len());
    }
    if !force {
        let message = "carries the torques that calib wrote already (columns tau1_nm to remark): fed in again, a reader may add them twice. Take the motion of before, or insist with --force, which writes these columns anew";
        return Err(Error::data(place, message));
    }
    Ok(first)
}

/// A motion of so many joints and rows, with the lists that the columns fill.
fn empty_motion(joints: usize, rows: usize, columns: &[MotionColumn]) -> PlannedMotion {
    let list = |role, count: usize| {
        let mut columns = columns.iter();
        let is_there = columns.any(|column| column.1 == role);
        is_there.then(|| vec![0.0; count * rows])
    };
    PlannedMotion {
        joints,
        time: vec![0.0; rows],
        position: vec![0.0; joints * rows],
        velocity: list(ColumnRole::Velocity(0), joints),
        acceleration: list(ColumnRole::Acceleration(0), joints),
        temperature: list(ColumnRole::Temperature, 1),
        since_start: None,
    }
}

/// Takes a number of a row.
fn put(motion: &mut PlannedMotion, row: usize, role: ColumnRole, value: f64) {
    let (list, joint, n) = match role {
        ColumnRole::Joint(joint) => (Some(&mut motion.position), joint, motion.joints),
        ColumnRole::Velocity(joint) => (motion.velocity.as_mut(), joint, motion.joints),
        ColumnRole::Acceleration(joint) => (motion.acceleration.as_mut(), joint, motion.joints),
        ColumnRole::Temperature => (motion.temperature.as_mut(), 0, 1),
        _ => (Some(&mut motion.time), 0, 1),
    };
    if let Some(list) = list {
        list[n * row + joint] = value;
    }
}

/// Endings of a column's name, with what a unit is in SI.
const DEG: f64 = std::f64::consts::PI / 180.0;
const TIMES: [(&str, f64); 2] = [("time_s", 1.0), ("time_ms", 1e-3)];
const PER_JOINT: [(&str, RoleOfJoint, [UnitEnding; 2]); 3] = [
    ("q", ColumnRole::Joint, [("_deg", DEG), ("_rad", 1.0)]),
    (
        "dq",
        ColumnRole::Velocity,
        [("_deg_s", DEG), ("_rad_s", 1.0)],
    ),
    (
        "ddq",
        ColumnRole::Acceleration,
        [("_deg_s2", DEG), ("_rad_s2", 1.0)],
    ),
];

type RoleOfJoint = fn(usize) -> ColumnRole;
type UnitEnding = (&'static str, f64);

fn columns(place: &str, names: &[String], robot: &RobotDescription) -> Result<Vec<MotionColumn>> {
    let n = robot.joints.len();
    let (columns, mut faults) = read_columns(place, names, |name| {
        let unknown = || {
            format!(
                "unknown column `{name}`; allowed: time_s or time_ms, q1_deg to q{n}_deg or _rad (or the robot's joint names), \
                 dq1_deg_s or _rad_s, ddq1_deg_s2 or _rad_s2, temp_c"
            )
        };
        column(name, robot).map(Some).ok_or_else(unknown)
    });
    let has = |role: ColumnRole| columns.iter().any(|column| column.1 == role);
    if faults.is_empty() && !has(ColumnRole::Time) {
        faults.push(Fault::new(place, "has no column time_s"));
    }
    for (what, role, _) in PER_JOINT {
        let found = (0..n).filter(|joint| has(role(*joint))).count();
        if faults.is_empty() && found != n && (what == "q" || found > 0) {
            let message = format!(
                "has columns {what} of {found} of the robot's {n} joints: give all of them"
            );
            faults.push(Fault::new(place, message));
        }
    }
    Error::if_spec(faults).map(|()| columns)
}

fn column(name: &str, robot: &RobotDescription) -> Option<(ColumnRole, f64)> {
    let lower = name.trim().to_lowercase();
    if let Some((_, unit)) = TIMES.iter().find(|(known, _)| *known == lower) {
        return Some((ColumnRole::Time, *unit));
    }
    if lower == "temp_c" {
        return Some((ColumnRole::Temperature, 1.0));
    }
    let named = |stem: &str| {
        let mut joints = robot.joints.iter();
        joints.position(|joint| joint.name.to_lowercase() == stem)
    };
    let in_unit = |what: &str, stem: &str| {
        let number = stem.strip_prefix(what)?.parse::<usize>().ok()?;
        (1..=robot.joints.len())
            .contains(&number)
            .then(|| number - 1)
    };
    PER_JOINT.iter().rev().find_map(|(what, role, units)| {
        units.iter().find_map(|(ending, unit)| {
            let stem = lower.strip_suffix(ending)?;
            let joint = in_unit(what, stem).or_else(|| named(stem).filter(|_| *what == "q"))?;
            Some((role(joint), *unit))
        })
    })
}
