//! What a recording's columns seem to hold, by their names and values: a proposal that a person checks.

use super::columns::{Choice, ExaminedFile, PointColumns, Points, points};
use super::names;
use super::names::{LENGTHS, joints};
use super::sheet::{number, tables};
use crate::error::{Result, listed};
use crate::stage::ingest::is_clock_time;
use crate::yaml::quoted;
use std::path::Path;

/// Larger numbers are no angles of joints, deg: wrists turn by a turn and a little more either way.
const MOST_DEGREES: f64 = 400.0;
/// No angle in rad is beyond this: a turn with a margin. What is beyond is in degrees.
const MOST_RADIANS: f64 = 6.5;
/// rad: no joint turns as often.
const MOST_TURNS: f64 = 65.0;
/// Rows of an arm that moves, at least, and what an angle goes on by from one to the next, on average, over its range.
const LEAST_ROWS: f64 = 20.0;
const STEP: f64 = 0.1;
/// Beyond this coordinates are millimetres, by the size of robots.
const MOST_METRES: f64 = 50.0;

/// The tables of a file, of which there is place for so many, of an arm of so many joints.
pub(super) fn examine(path: &Path, places: usize, joints: usize) -> Result<Vec<ExaminedFile>> {
    let examined = |sheet| {
        let mut found = ExaminedFile::unknown(path, sheet);
        if !found.sheet.header {
            found.bare(joints);
        } else if found.sheet.trouble.is_none() {
            found.joints(joints);
            found.point();
            found.quaternion();
            found.per_joint();
            found.scalars();
            found.time();
            found.texts();
        }
        found
    };
    Ok(tables(path, places)?.into_iter().map(examined).collect())
}

impl ExaminedFile {
    /// A list without a header: of points or joints, perhaps names, then three lengths, or six or seven angles; or of an arm of `count` joints
    /// that moved.
    fn bare(&mut self, count: usize) {
        let width = self.sheet.names.len();
        // A name in parts (collection, group, point) stands in columns of its own.
        let texts = (0..width).take_while(|column| !self.sheet.is_numeric(*column));
        let texts = texts.count();
        let numbered = usize::from(self.may_be_names(0) && [4, 7, 8].contains(&width));
        let named = texts.max(numbered);
        let columns: Vec<usize> = (named..width).collect();
        if !columns.iter().all(|column| self.sheet.is_numeric(*column)) {
            return;
        }
        if texts == 0 && self.bare_motion(&(0..width).collect::<Vec<_>>(), count) {
            return;
        }
        let most = self.largest(&columns);
        let (quantity, lines, what) = match columns[..] {
            [x, y, z] => {
                let unit = self.length_unit(&[x, y, z]).0;
                let lines = self.lines(["x", "y", "z"], [x, y, z], unit);
                ("x", lines, "the point".to_string())
            }
            // Seven numbers may be a point with a quaternion.
            [_, _, _, _, _, _] | [_, _, _, _, _, _, _]
                if most <= 400.0 && !self.is_unit(&columns[columns.len() - 4..]) =>
            {
                let unit = if most > MOST_RADIANS { "deg" } else { "rad" };
                let lines = vec![self.joints_line("q", &columns, Some(unit))];
                ("q", lines, format!("{} joints", columns.len()))
            }
            _ => return,
        };
        self.sheet.trouble = None;
        let account = format!("{what} ({})", self.shown(&columns));
        let check = "no header says so; is it right?".to_string();
        self.propose(quantity, [Choice::of(lines, columns)], [check], account);
    }

    /// Perhaps times, then angles, perhaps velocities, and torques, a column a joint each.
    fn bare_motion(&mut self, columns: &[usize], count: usize) -> bool {
        let times = columns.len() % count.max(1);
        let parts: Vec<&[usize]> = columns[times..].chunks(count.max(1)).collect();
        let is_clock = times == 0 || (times == 1 && self.runs(columns[0]));
        let (&[q, ref between @ .., torque], true) = (&parts[..], count > 1 && is_clock) else {
            return false;
        };
        let moves = |column: &usize| self.moves_on(*column);
        if between.len() > 1 || self.largest(q) > MOST_DEGREES || !q.iter().all(moves) {
            return false;
        }
        let unit = match self.largest(q) > MOST_RADIANS {
            true => "deg",
            false => "rad",
        };
        let check = "no header says so; is it right?";
        let velocity = between
            .first()
            .map(|columns| ("velocity", *columns, "rad/s"));
        let parts = [("q", q, unit)].into_iter().chain(velocity);
        let parts: Vec<_> = parts.chain([("torque", torque, "Nm")]).collect();
        self.sheet.trouble = None;
        for (quantity, columns, unit) in parts {
            let (first, last) = (columns[0] + 1, columns[columns.len() - 1] + 1);
            let line = self.joints_line(quantity, columns, Some(unit));
            let account = format!("{quantity} (columns {first} to {last})");
            self.propose(
                quantity,
                [Choice::of(vec![line], columns.to_vec())],
                [check.into()],
                account,
            );
        }
        match times {
            1 => self.map("time", &columns[..1], Some("s"), Some("the unit".into())),
            _ => {
                let line = "time: {rate: 100}".to_string();
                let check = "rows a second; nothing says how many".to_string();
                self.propose(
                    "time",
                    [Choice::of(vec![line], Vec::new())],
                    [check],
                    "time by a rate".into(),
                );
            }
        }
        true
    }

    /// Whether a column goes on from row to row, as angles of an arm that moves do and those of poses do not.
    fn moves_on(&self, column: usize) -> bool {
        let values: Vec<f64> = self.sheet.numbers(column).collect();
        let steps: f64 = values
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .sum();
        let [least, most] = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
                [a.min(*x), b.max(*x)]
            });
        let rows = values.len() as f64;
        rows > LEAST_ROWS && steps <= STEP * rows * (most - least)
    }

    fn joints(&mut self, count: usize) {
        let angle = |column: usize| {
            let unit = self.stated[column].unit;
            self.sheet.is_numeric(column)
                && self.sheet.largest(column) <= MOST_DEGREES
                && unit.is_none_or(|unit| ["deg", "rad"].contains(&unit))
        };
        let counted = |column: usize| {
            let is_whole = self
                .sheet
                .numbers(column)
                .all(|number| number.fract() == 0.0);
            let none_said = self.stated[column].unit.is_none();
            none_said && self.sheet.is_numeric(column) && is_whole
        };
        let mut rows = joints(&self.stated, count, angle);
        let in_counts = rows.is_empty();
        if in_counts {
            rows = joints(&self.stated, count, counted);
        }
        rows.retain(|columns| {
            columns.iter().all(|column| self.sheet.is_numeric(*column)) && !self.is_unit(columns)
        });
        // A list holds what else an arm has beside its joints: a gripper.
        let list = rows
            .first()
            .filter(|row| self.sheet.names[row[0]].ends_with(']'));
        let numbers = list.map_or(0, Vec::len);
        if numbers > count {
            rows.iter_mut().for_each(|row| row.truncate(count));
        }
        let Some(best) = rows.first() else { return };
        let turns = |column: &usize| self.stated[*column].unit_of(&LENGTHS).is_none();
        let turning: Vec<usize> = best.iter().copied().filter(turns).collect();
        let mut units = best.iter().map(|column| &self.stated[*column]);
        let (unit, why) = match units.find_map(|name| name.unit_of(&["deg", "rad"])) {
            Some(unit) => (unit, None),
            None if self.largest(&turning) > MOST_RADIANS && !self.turn_often(&turning) => {
                ("deg", Some("values beyond 6.5 cannot be radians"))
            }
            None if self.largest(&turning) > MOST_RADIANS => (
                "rad",
                Some("few joints go beyond 6.5: several turns in radians; or degrees?"),
            ),
            // The names of UR's real-time interface (RTDE), whose angles are radians.
            None if self.sheet.names[best[0]].starts_with("actual_q_") => ("rad", None),
            None => ("rad", Some("no value is beyond 6.5; are these degrees?")),
        };
        let why = why.map(String::from);
        let several = (rows.len() > 1).then(|| "several columns of joints fit".to_string());
        let of_list = (numbers > count)
            .then(|| format!("of the {numbers} numbers of the list the first {count}"));
        let checks = several.into_iter().chain(of_list).chain(why);
        let what = format!("{} joints", best.len());
        if in_counts && self.largest(&turning) > MOST_DEGREES {
            let why = "counts of an encoder; how many are a turn, and which is zero?".to_string();
            self.propose_joints("q", &rows, None, [why], &what);
            return self.add("q", "counts_per_turn: 4096");
        }
        self.propose_joints("q", &rows, Some(unit), checks, &what);
    }

    /// Whether most joints stay within a turn in radians and the others within a few: joints may turn more than once.
    fn turn_often(&self, turning: &[usize]) -> bool {
        let far = turning.iter().map(|column| self.sheet.largest(*column));
        let beyond: Vec<f64> = far.filter(|angle| *angle > MOST_RADIANS).collect();
        2 * beyond.len() < turning.len() && beyond.iter().all(|angle| *angle < MOST_TURNS)
    }

    /// Whether four columns are a quaternion.
    fn is_unit(&self, columns: &[usize]) -> bool {
        let is_one = |row: &Vec<String>| {
            let numbers = columns.iter().filter_map(|column| number(&row[*column]));
            let square: f64 = numbers.map(|x| x * x).sum();
            (square - 1.0).abs() < 1e-3
        };
        columns.len() == 4 && self.sheet.rows.iter().all(is_one)
    }

    fn point(&mut self) {
        let found = points(&self.stated);
        let mut all = found.targets.iter().flat_map(|(_, columns)| columns);
        if all.all(|column| self.sheet.holds_numbers(*column)) && self.targets(&found) {
            return;
        }
        let numeric = |way: &&PointColumns| {
            let more = way.difference.iter().flat_map(|(columns, _)| columns);
            let mut all = way.columns.iter().chain(more);
            all.all(|column| self.sheet.is_numeric(*column))
        };
        let ways: Vec<&PointColumns> = found.ways.iter().filter(numeric).collect();
        let Some(best) = ways.first() else {
            let only = found.wanted.map(|wanted| {
                let names = quoted(&self.shown(&wanted));
                format!("only a target is there, no measured point: {names}")
            });
            self.remarks.extend(only);
            return;
        };
        if let Some(sigma) = found.sigma {
            // In the unit of the point, unless the name says another.
            let unit = self.stated[sigma[0]]
                .unit_of(&LENGTHS)
                .unwrap_or(self.length_unit(&best.columns).0);
            let (names, what) = match self.stated[sigma[0]].stem().contains(names::U95) {
                true => (["u95_x", "u95_y", "u95_z"], "two standard deviations"),
                false => (["sigma_x", "sigma_y", "sigma_z"], "one standard deviation"),
            };
            let lines = self.lines(names, sigma, unit);
            self.remarks.push(format!(
                "{}   # CHECK: {what}, if rows are to be weighted by it",
                lines[0]
            ));
            self.remarks.extend(lines.into_iter().skip(1));
        }
        let (_, by_size) = self.length_unit(&best.columns);
        let by_size = by_size.then(|| "the unit, by the size of the numbers".to_string());
        let checks = found.question.into_iter().chain(by_size);
        let source = match found.is_stated {
            true => "the measured point",
            false => "the point",
        };
        let less = best
            .difference
            .map_or_else(String::new, |(columns, minus)| {
                let sign = if minus { "less" } else { "plus" };
                format!("; {sign} {}", self.shown(&columns))
            });
        let choices: Vec<Choice> = ways.iter().map(|way| self.way(way)).collect();
        let account = format!("{source} ({}{less})", self.shown(&best.columns));
        self.propose("x", choices, checks, account);
    }

    /// A quaternion beside the point, as lines to take in: with a standard deviation, which only the instrument's owner knows, rows are full
    /// poses.
    fn quaternion(&mut self) {
        let column = |name: String| {
            let fits = |k: &usize| self.stated[*k].stem() == name && self.sheet.holds_numbers(*k);
            (0..self.stated.len()).find(fits)
        };
        let all = |prefix: &&str| -> Option<Vec<usize>> {
            let axes = ["w", "x", "y", "z"].into_iter();
            axes.map(|axis| column(format!("{prefix}{axis}"))).collect()
        };
        let found = names::QUATERNIONS.iter().find_map(all);
        let is_unit = |columns: &Vec<usize>| self.largest(columns) <= 1.0 + 1e-3;
        let Some(columns) = found.filter(is_unit).filter(|_| self.has("x")) else {
            return;
        };
        let names = self.references(&columns);
        self.remarks.push(format!(
            "orientation: {{quaternion: {names}}}   # CHECK: full poses, with the line below and your instrument's figure"
        ));
        self.remarks
            .push("sigma_orientation: {value: 30, unit: arcsec}".into());
    }

    /// Several targets side by side, or one of them alone; whether there are such.
    fn targets(&mut self, found: &Points) -> bool {
        let Some((_, first)) = found.targets.first() else {
            return false;
        };
        let unit = self.length_unit(first).0;
        let one = |(name, columns): &(String, [usize; 3])| {
            format!("{name}: {}", self.references(columns))
        };
        let all: Vec<String> = found.targets.iter().map(one).collect();
        let columns = found.targets.iter().flat_map(|(_, columns)| *columns);
        let all = all.join(", ");
        let all = Choice {
            lines: Vec::new(),
            targets: Some(format!("targets: {{unit: {unit}, columns: {{{all}}}}}")),
            columns: columns.collect(),
        };
        let ways = found.ways.iter().map(|way| self.way(way));
        let choices: Vec<Choice> = std::iter::once(all).chain(ways).collect();
        let names = listed(found.targets.iter().map(|(name, _)| name));
        let count = found.targets.len();
        let account = format!("the points of {count} targets ({names})");
        let check =
            "are these several reflectors, each measured in every pose, and is the unit right?";
        self.propose("x", choices, [check.to_string()], account);
        true
    }

    fn way(&self, way: &PointColumns) -> Choice {
        let unit = self.length_unit(&way.columns).0;
        let Some((difference, minus)) = way.difference else {
            let lines = self.lines(["x", "y", "z"], way.columns, unit);
            return Choice::of(lines, way.columns.to_vec());
        };
        let key = if minus { "minus" } else { "plus" };
        let lines = (["x", "y", "z"].iter().zip(way.columns).zip(difference)).map(
            |((name, target), column)| {
                let other = self.stated[column].unit_of(&LENGTHS);
                let other = other.filter(|other| *other != unit);
                let other = other.map(|other| format!(", difference_unit: {other}"));
                let other = other.unwrap_or_default();
                let [target, column] = [target, column].map(|column| self.reference(column));
                format!("{name}: {{column: {target}, {key}: {column}, unit: {unit}{other}}}")
            },
        );
        Choice::of(lines.collect(), [way.columns, difference].concat())
    }

    /// The unit of coordinates, and whether their size alone says so.
    pub(super) fn length_unit(&self, columns: &[usize]) -> (&'static str, bool) {
        let mut units = columns.iter().map(|column| &self.stated[*column]);
        if let Some(unit) = units.find_map(|name| name.unit_of(&LENGTHS)) {
            return (unit, false);
        }
        let is_far = self.largest(columns) > MOST_METRES;
        (if is_far { "mm" } else { "m" }, true)
    }

    fn largest(&self, columns: &[usize]) -> f64 {
        let all = columns.iter().map(|column| self.sheet.largest(*column));
        all.fold(0.0, f64::max)
    }

    /// Motor currents, directions of approach and velocities under calib's own names.
    fn per_joint(&mut self) {
        let Some(count) = self.joint_count() else {
            return;
        };
        for (quantity, pattern, unit) in [
            ("current", "i{j}_a", Some("A")),
            ("direction", "dir{j}", None),
            ("velocity", "dq{j}_deg_s", Some("deg/s")),
        ] {
            let column = |n: usize| {
                let wanted = pattern.replace("{j}", &n.to_string());
                self.sheet.names.iter().position(|name| *name == wanted)
            };
            let columns: Vec<usize> = (1..).map_while(column).collect();
            if columns.len() == count {
                let lines = vec![self.joints_line(quantity, &columns, unit)];
                let account = format!("{quantity} ({pattern})");
                self.propose(quantity, [Choice::of(lines, columns)], None, account);
            }
        }
    }

    fn scalars(&mut self) {
        for (quantity, listed, unit, most) in [
            ("payload", names::PAYLOADS, "kg", 1e4),
            ("temperature", names::TEMPERATURES, "C", 200.0),
        ] {
            let fits = |column: &usize| {
                let name = &self.stated[*column];
                let named = match quantity {
                    "payload" => names::lists(listed, &name.stem()),
                    _ => name.is(listed),
                };
                let plausible =
                    self.sheet.is_numeric(*column) && self.sheet.largest(*column) <= most;
                let in_unit = name.unit.is_none_or(|other| other == unit);
                named && plausible && in_unit && !self.is_taken(*column)
            };
            let columns: Vec<usize> = (0..self.stated.len()).filter(fits).collect();
            let Some(first) = columns.first() else {
                continue;
            };
            let check = (self.stated[*first].unit.is_none()).then(|| "the unit".to_string());
            self.map(quantity, &columns, Some(unit), check);
        }
    }

    fn time(&mut self) {
        let named =
            |column: &usize| self.stated[*column].is(names::TIMES) && !self.is_taken(*column);
        let unit = |column: usize| match self.stated[column].unit {
            // Beyond what ms of a date are, it is finer than any unit that is read.
            None => match self.sheet.largest(column) {
                ..=1e11 => Some(("s", false)),
                ..1e14 => Some(("ms", false)),
                _ => None,
            },
            Some(unit) => Some((unit, true)).filter(|(unit, _)| ["s", "ms"].contains(unit)),
        };
        let columns: Vec<usize> = (0..self.stated.len()).filter(named).collect();
        let is_running = |column: &usize| unit(*column).is_some() && self.runs(*column);
        let is_clock = |column: &usize| {
            let mut texts = self.sheet.texts(*column).peekable();
            texts.peek().is_some() && texts.all(is_clock_time)
        };
        let running: Vec<usize> = columns.iter().copied().filter(is_running).collect();
        let clocks: Vec<usize> = columns.iter().copied().filter(is_clock).collect();
        let is_known = |column: &&usize| running.contains(column) || clocks.contains(column);
        for column in columns.iter().filter(|column| !is_known(column)) {
            let name = quoted(&self.sheet.names[*column]);
            self.remarks.push(format!(
                "{name} cannot be read as time; allowed: s or ms as numbers that never decrease, 08:15:03, 2026-11-22T08:15:03, 22.11.2026 08:15:03, or 11/22/2026 8:15:03 AM"
            ));
        }
        let Some((unit, is_stated)) = running.first().and_then(|column| unit(*column)) else {
            let has_slash =
                |column: &usize| self.sheet.texts(*column).any(|cell| cell.contains('/'));
            let slashes = clocks.iter().any(has_slash);
            let check = slashes.then(|| "the month stands before the day".to_string());
            self.map("time", &clocks, Some("clock"), check);
            return;
        };
        self.second = if unit == "ms" { 1e-3 } else { 1.0 };
        let check = (!is_stated).then(|| "the unit".to_string());
        self.map("time", &running, Some(unit), check);
    }

    /// Whether numbers do not fall, do not stand still, and are no dates in digits (20201103154500).
    fn runs(&self, column: usize) -> bool {
        let times: Vec<f64> = self.sheet.numbers(column).collect();
        let falls = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let dates = times.iter().all(|time| (1.9e13..2.2e13).contains(time));
        let moves = times.last() > times.first();
        self.sheet.is_numeric(column) && moves && !dates && 20 * falls <= times.len()
    }

    /// What rows are for, which reflector they measured, and what points are called in a file that stands alone.
    fn texts(&mut self) {
        let few = |column: usize| {
            let distinct = self.distinct(column);
            (2..=10).contains(&distinct)
                && 3 * distinct <= self.sheet.rows.len()
                && !self.sheet.is_numeric(column)
        };
        let [usages, reflectors] = [names::USAGES, names::REFLECTORS].map(|list| {
            let is_listed = |column: &usize| names::lists(list, &self.stated[*column].stem());
            let listed = (0..self.stated.len()).filter(is_listed);
            listed.filter(|column| few(*column)).collect::<Vec<usize>>()
        });
        self.map("usage", &usages, None, None);
        let question = "which of several reflectors was measured?";
        self.map("target", &reflectors, None, Some(question.into()));
    }
}
