//! A planned motion as delimited text: times and joints in even steps; what it needs of torque is appended, all else stays.

use super::columns::{ColumnRole, ReadColumn, read_columns};
use super::text::{TableText, TextField, fields, parse, table};
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
        let table = table(text, place, "a header line and a motion")?;
        let TableText {
            delimiter,
            header,
            names,
            rows: lines,
        } = table;
        let everything = names.len();
        let kept = kept(place, &names, robot.joints.len(), force)?;
        let header = kept
            .checked_sub(1)
            .map_or(header, |last| &header[..names[last].0.end]);
        let names: Vec<String> = names
            .into_iter()
            .take(kept)
            .map(|field| field.1.into_owned())
            .collect();
        let columns = columns(place, &names, robot)?;
        let mut trajectory = Self {
            motion: empty_motion(robot.joints.len(), &columns),
            header,
            lines,
            delimiter,
            point: '.',
        };
        for (_, line) in &mut trajectory.lines {
            // What cannot be split is told where the line is read.
            let end = fields(line, delimiter)
                .ok()
                .and_then(|cells| cells.get(kept.checked_sub(1)?).map(|cell| cell.0.end));
            *line = end
                .filter(|_| kept < everything)
                .map_or(*line, |end| &line[..end]);
        }
        trajectory.fill(place, &columns)?;
        trajectory.check_clock(place)?;
        Ok(trajectory)
    }

    /// Reads all rows.
    fn fill(&mut self, place: &str, columns: &[MotionColumn]) -> Result<()> {
        let (n, rows) = (self.motion.joints, self.lines.len());
        let mut faults = Vec::new();
        for list in [&mut self.motion.velocity, &mut self.motion.acceleration]
            .into_iter()
            .flatten()
        {
            list.resize(n * rows, 0.0);
        }
        self.motion
            .temperature
            .iter_mut()
            .for_each(|list| list.resize(rows, 0.0));
        self.motion.time.resize(rows, 0.0);
        self.motion.position.resize(n * rows, 0.0);
        for row in 0..rows {
            let (number, line) = self.lines[row];
            let mut fault = |message: String| {
                if faults.len() < LIMIT {
                    faults.push(Fault::new(format!("{place}:{number}"), message));
                }
            };
            let cells = match fields(line, self.delimiter) {
                Ok(cells) if cells.len() == columns.len() => cells,
                Ok(cells) => {
                    fault(format!(
                        "has {} cells, the header {}",
                        cells.len(),
                        columns.len()
                    ));
                    continue;
                }
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
        if faults.is_empty() {
            Ok(())
        } else {
            Err(Error::Data(faults))
        }
    }

    /// Times must grow in even steps: derivatives are by differences of rows.
    fn check_clock(&self, place: &str) -> Result<()> {
        let time = &self.motion.time;
        let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual = crate::statistics::nearest(&mut steps, 0.5).unwrap_or(0.0);
        let wrong = |row: usize, message: String| {
            Err(Error::data(
                format!("{place}:{}", self.lines[row + 1].0),
                message,
            ))
        };
        if let Some((row, pair)) = time
            .windows(2)
            .enumerate()
            .find(|(_, pair)| pair[1] <= pair[0])
        {
            return wrong(
                row,
                format!(
                    "the time does not increase: {} s after {} s",
                    pair[1], pair[0]
                ),
            );
        }
        let uneven = |pair: &[f64]| (pair[1] - pair[0] - usual).abs() > UNEVEN * usual;
        if let Some((row, pair)) = time.windows(2).enumerate().find(|(_, pair)| uneven(pair)) {
            let step = pair[1] - pair[0];
            let message = format!(
                "the clock is uneven: a step of {step:.6} s, usual are {usual:.6} s; give the motion in even steps"
            );
            return wrong(row, message);
        }
        Ok(())
    }

    /// The lines with torques (Nm), currents (A) where `per_ampere` says what an ampere is, uncertainties (Nm) where they are known, and
    /// the remarks of each row; a row that is refused has no torques.
    pub(crate) fn written(
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
            needed.torque[cells.clone()]
                .iter()
                .for_each(|torque| number(allowed(*torque)));
            if let Some(factors) = per_ampere {
                needed.torque[cells.clone()]
                    .iter()
                    .zip(factors)
                    .for_each(|(torque, factor)| number(allowed(torque / factor)));
            }
            needed
                .u95
                .iter()
                .flat_map(|all| &all[cells.clone()])
                .for_each(|u95| number(Some(*u95)));
            text.push(between);
            text::push_text(&mut text, &judged.to_string(), between);
            text.push('\n');
        }
        text
    }

    /// The place of a row in its text.
    pub(crate) fn place(&self, row: usize, file: &str) -> String {
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
    let is = |at: usize, name: &str| names.get(at).is_some_and(|field| field.1 == name);
    let Some(first) = (0..names.len()).find(|at| is(*at, "tau1_nm")) else {
        return Ok(names.len());
    };
    let ours = |currents: bool, u95: bool| {
        let all: Vec<String> = appended(joints, currents, u95).collect();
        first + all.len() == names.len()
            && all.iter().enumerate().all(|(k, name)| is(first + k, name))
    };
    let written = [(true, true), (true, false), (false, true), (false, false)]
        .into_iter()
        .any(|(i, u)| ours(i, u));
    if !written {
        return Ok(names.len());
    }
    if !force {
        let message = "carries the torques that calib wrote already (columns tau1_nm to remark): fed in again, a reader may add them twice. Take the motion of before, or insist with --force, which writes these columns anew";
        return Err(Error::data(place, message));
    }
    Ok(first)
}

/// A motion of so many joints without rows, with the lists that the columns fill.
fn empty_motion(joints: usize, columns: &[MotionColumn]) -> PlannedMotion {
    let has = |role| columns.iter().any(|column| column.1 == role).then(Vec::new);
    PlannedMotion {
        joints,
        time: Vec::new(),
        position: Vec::new(),
        velocity: has(ColumnRole::Velocity(0)),
        acceleration: has(ColumnRole::Acceleration(0)),
        temperature: has(ColumnRole::Temperature),
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
const PER_JOINT: [(&str, &str, f64); 6] = [
    ("ddq", "_deg_s2", DEG),
    ("ddq", "_rad_s2", 1.0),
    ("dq", "_deg_s", DEG),
    ("dq", "_rad_s", 1.0),
    ("q", "_deg", DEG),
    ("q", "_rad", 1.0),
];

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
    let roles = [
        ColumnRole::Joint,
        ColumnRole::Velocity,
        ColumnRole::Acceleration,
    ];
    for (what, role) in ["q", "dq", "ddq"]
        .into_iter()
        .zip(roles as [fn(usize) -> ColumnRole; 3])
    {
        let found = (0..n).filter(|joint| has(role(*joint))).count();
        if faults.is_empty() && found != n && (what == "q" || found > 0) {
            let message = format!(
                "has columns {what} of {found} of the robot's {n} joints: give all of them"
            );
            faults.push(Fault::new(place, message));
        }
    }
    if faults.is_empty() {
        Ok(columns)
    } else {
        Err(Error::Spec(faults))
    }
}

fn column(name: &str, robot: &RobotDescription) -> Option<(ColumnRole, f64)> {
    let lower = name.trim().to_lowercase();
    if let Some((_, unit)) = TIMES.iter().find(|(known, _)| *known == lower) {
        return Some((ColumnRole::Time, *unit));
    }
    if lower == "temp_c" {
        return Some((ColumnRole::Temperature, 1.0));
    }
    for (what, ending, unit) in PER_JOINT {
        let Some(stem) = lower.strip_suffix(ending) else {
            continue;
        };
        let number = stem
            .strip_prefix(what)
            .and_then(|number| number.parse::<usize>().ok());
        let numbered = number
            .filter(|number| (1..=robot.joints.len()).contains(number))
            .map(|number| number - 1);
        let named = || {
            robot
                .joints
                .iter()
                .position(|joint| what == "q" && joint.name.to_lowercase() == stem)
        };
        if let Some(joint) = numbered.or_else(named) {
            let role = match what {
                "q" => ColumnRole::Joint(joint),
                "dq" => ColumnRole::Velocity(joint),
                _ => ColumnRole::Acceleration(joint),
            };
            return Some((role, unit));
        }
    }
    None
}
