//! What a recording's columns seem to hold, by their names and values: a proposal that a person checks.

use super::columns::{Choice, ExaminedFile, PointColumns, Points, points};
use super::names;
use super::names::{LENGTHS, joints};
use super::sheet::{number, tables};
use crate::error::Result;
use crate::stage::ingest::is_clock_time;
use crate::yaml::quoted;
use std::path::Path;

/// No angle in rad is beyond this.
const MOST_RADIANS: f64 = 6.5;
/// Beyond this coordinates are millimetres, by the size of robots.
const MOST_METRES: f64 = 50.0;

/// The tables of a file, of which there is place for so many, of an arm of so many joints.
pub(super) fn examine(path: &Path, places: usize, joints: usize) -> Result<Vec<ExaminedFile>> {
    let examined = |sheet| {
        let mut found = ExaminedFile::unknown(path, sheet);
        if !found.sheet.header {
            found.bare();
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
    /// A list of points, or of joints, without a header: perhaps names, then three lengths, or six or seven angles.
    fn bare(&mut self) {
        let width = self.sheet.names.len();
        // A name in parts (collection, group, point) stands in columns of its own.
        let texts = (0..width)
            .take_while(|column| !self.sheet.is_numeric(*column))
            .count();
        let numbered = usize::from(self.may_be_names(0) && [4, 7, 8].contains(&width));
        let named = texts.max(numbered);
        let columns: Vec<usize> = (named..width).collect();
        if !columns.iter().all(|column| self.sheet.is_numeric(*column)) {
            return;
        }
        let most = columns
            .iter()
            .map(|column| self.sheet.largest(*column))
            .fold(0.0, f64::max);
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

    fn joints(&mut self, count: usize) {
        let angle = |column: usize| {
            self.sheet.is_numeric(column)
                && self.sheet.largest(column) <= 400.0
                && self.stated[column]
                    .unit
                    .is_none_or(|unit| ["deg", "rad"].contains(&unit))
        };
        let mut rows = joints(&self.stated, count, angle);
        rows.retain(|columns| {
            columns.iter().all(|column| self.sheet.is_numeric(*column)) && !self.is_unit(columns)
        });
        // A list holds what else an arm has beside its joints: a gripper.
        let numbers = rows
            .first()
            .filter(|row| self.sheet.names[row[0]].ends_with(']'))
            .map_or(0, Vec::len);
        rows.iter_mut()
            .filter(|_| numbers > count)
            .for_each(|row| row.truncate(count));
        let Some(best) = rows.first() else { return };
        let turning = |column: &&usize| self.stated[**column].unit_of(&LENGTHS).is_none();
        let degrees = best
            .iter()
            .filter(turning)
            .any(|column| self.sheet.largest(*column) > MOST_RADIANS);
        let named = best
            .iter()
            .find_map(|column| self.stated[*column].unit_of(&["deg", "rad"]));
        let (unit, why) = match named {
            Some(unit) => (unit, None),
            None if degrees => (
                "deg",
                Some("values beyond 6.5 cannot be radians".to_string()),
            ),
            None => (
                "rad",
                Some("no value is beyond 6.5; are these degrees?".to_string()),
            ),
        };
        let several = (rows.len() > 1).then(|| "several columns of joints fit".to_string());
        let of_list = (numbers > count)
            .then(|| format!("of the {numbers} numbers of the list the first {count}"));
        let checks = several.into_iter().chain(of_list).chain(why);
        let what = format!("{} joints", best.len());
        self.propose_joints("q", &rows, Some(unit), checks, &what);
    }

    /// Whether four columns are a quaternion.
    fn is_unit(&self, columns: &[usize]) -> bool {
        let square = |row: &Vec<String>| {
            columns
                .iter()
                .filter_map(|column| number(&row[*column]))
                .map(|x| x * x)
                .sum::<f64>()
        };
        columns.len() == 4
            && self
                .sheet
                .rows
                .iter()
                .all(|row| (square(row) - 1.0).abs() < 1e-3)
    }

    fn point(&mut self) {
        let found = points(&self.stated);
        if found
            .targets
            .iter()
            .flat_map(|(_, columns)| columns)
            .all(|column| self.sheet.holds_numbers(*column))
            && self.targets(&found)
        {
            return;
        }
        let numeric = |way: &PointColumns| {
            let more = way.difference.iter().flat_map(|(columns, _)| columns);
            way.columns
                .iter()
                .chain(more)
                .all(|column| self.sheet.is_numeric(*column))
        };
        let ways: Vec<&PointColumns> = found.ways.iter().filter(|way| numeric(way)).collect();
        let Some(best) = ways.first() else {
            if let Some(wanted) = found.wanted {
                self.remarks.push(format!(
                    "only a target is there, no measured point: {}",
                    quoted(&self.shown(&wanted))
                ));
            }
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
        let by_size = self
            .length_unit(&best.columns)
            .1
            .then(|| "the unit, by the size of the numbers".to_string());
        let checks = found.question.into_iter().chain(by_size);
        let source = if found.is_stated {
            "the measured point"
        } else {
            "the point"
        };
        let less = best.difference.map(|(columns, minus)| {
            format!(
                "; {} {}",
                if minus { "less" } else { "plus" },
                self.shown(&columns)
            )
        });
        let less = less.unwrap_or_default();
        let choices: Vec<Choice> = ways.iter().map(|way| self.way(way)).collect();
        let account = format!("{source} ({}{less})", self.shown(&best.columns));
        self.propose("x", choices, checks, account);
    }

    /// A quaternion beside the point, as lines to take in: with a standard deviation, which only the instrument's owner knows, rows are full
    /// poses.
    fn quaternion(&mut self) {
        let column = |name: &str| {
            (0..self.stated.len())
                .find(|k| self.stated[*k].stem() == name && self.sheet.holds_numbers(*k))
        };
        let all =
            |prefix: &&str| ["w", "x", "y", "z"].map(|axis| column(&format!("{prefix}{axis}")));
        let found = names::QUATERNIONS
            .iter()
            .map(all)
            .find_map(|columns| columns.into_iter().collect::<Option<Vec<usize>>>());
        let unit = |columns: &Vec<usize>| {
            columns
                .iter()
                .all(|column| self.sheet.largest(*column) <= 1.0 + 1e-3)
        };
        let Some(columns) = found.filter(unit).filter(|_| self.get("x").is_some()) else {
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
        let columns = found
            .targets
            .iter()
            .flat_map(|(_, columns)| *columns)
            .collect();
        let targets = Some(format!(
            "targets: {{unit: {unit}, columns: {{{}}}}}",
            all.join(", ")
        ));
        let all = Choice {
            columns,
            targets,
            ..Choice::default()
        };
        let ways = found.ways.iter().map(|way| self.way(way));
        let choices: Vec<Choice> = std::iter::once(all).chain(ways).collect();
        let names: Vec<&str> = found
            .targets
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        let account = format!(
            "the points of {} targets ({})",
            names.len(),
            names.join(", ")
        );
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
                let other = other
                    .filter(|other| *other != unit)
                    .map(|other| format!(", difference_unit: {other}"))
                    .unwrap_or_default();
                let [target, column] = [target, column].map(|column| self.reference(column));
                format!("{name}: {{column: {target}, {key}: {column}, unit: {unit}{other}}}")
            },
        );
        Choice::of(lines.collect(), [way.columns, difference].concat())
    }

    /// The unit of coordinates, and whether their size alone says so.
    pub(super) fn length_unit(&self, columns: &[usize]) -> (&'static str, bool) {
        if let Some(unit) = columns
            .iter()
            .find_map(|column| self.stated[*column].unit_of(&LENGTHS))
        {
            return (unit, false);
        }
        let farthest = columns
            .iter()
            .map(|column| self.sheet.largest(*column))
            .fold(0.0, f64::max);
        (if farthest > MOST_METRES { "mm" } else { "m" }, true)
    }

    /// Motor currents, directions of approach and velocities under calib's own names.
    fn per_joint(&mut self) {
        let Some(count) = self.get("q").map(|joints| joints.choices[0].columns.len()) else {
            return;
        };
        for (quantity, pattern, unit) in [
            ("current", "i{j}_a", Some("A")),
            ("direction", "dir{j}", None),
            ("velocity", "dq{j}_deg_s", Some("deg/s")),
        ] {
            let column = |n: usize| {
                self.sheet
                    .names
                    .iter()
                    .position(|name| *name == pattern.replace("{j}", &n.to_string()))
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
                let named = if quantity == "payload" {
                    names::lists(listed, &name.stem())
                } else {
                    name.is(listed)
                };
                let plausible =
                    self.sheet.is_numeric(*column) && self.sheet.largest(*column) <= most;
                named
                    && plausible
                    && !self.is_taken(*column)
                    && name.unit.is_none_or(|other| other == unit)
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
            None => Some((
                if self.sheet.largest(column) > 1e11 {
                    "ms"
                } else {
                    "s"
                },
                false,
            ))
            .filter(|_| self.sheet.largest(column) < 1e14),
            Some(unit) => Some((unit, true)).filter(|(unit, _)| ["s", "ms"].contains(unit)),
        };
        let columns: Vec<usize> = (0..self.stated.len()).filter(named).collect();
        let running: Vec<usize> = columns
            .iter()
            .copied()
            .filter(|column| unit(*column).is_some() && self.runs(*column))
            .collect();
        let is_clock = |column: &usize| {
            let mut texts = self
                .sheet
                .texts(*column)
                .filter(|text| !text.is_empty())
                .peekable();
            texts.peek().is_some() && texts.all(is_clock_time)
        };
        let clocks: Vec<usize> = columns.iter().copied().filter(is_clock).collect();
        for column in columns
            .iter()
            .filter(|column| !running.contains(column) && !clocks.contains(column))
        {
            let name = quoted(&self.sheet.names[*column]);
            self.remarks.push(format!(
                "{name} cannot be read as time; allowed: s or ms as numbers that never decrease, 08:15:03, or 2026-11-22T08:15:03"
            ));
        }
        let Some((unit, is_stated)) = running.first().and_then(|column| unit(*column)) else {
            self.map("time", &clocks, Some("clock"), None);
            return;
        };
        self.second = if unit == "ms" { 1e-3 } else { 1.0 };
        self.map(
            "time",
            &running,
            Some(unit),
            (!is_stated).then(|| "the unit".to_string()),
        );
    }

    /// Whether numbers do not fall, do not stand still, and are no dates in digits (20201103154500).
    fn runs(&self, column: usize) -> bool {
        let times: Vec<f64> = self.sheet.numbers(column).collect();
        let falls = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let dates = times.iter().all(|time| (1.9e13..2.2e13).contains(time));
        let moves = times
            .first()
            .zip(times.last())
            .is_some_and(|(first, last)| last > first);
        self.sheet.is_numeric(column) && moves && !dates && 20 * falls <= times.len()
    }

    /// What rows are for, which reflector they measured, and what points are called in a file that stands alone.
    fn texts(&mut self) {
        let columns = 0..self.stated.len();
        let few = |column: usize| {
            let distinct = self.distinct(column);
            (2..=10).contains(&distinct)
                && 3 * distinct <= self.sheet.rows.len()
                && !self.sheet.is_numeric(column)
        };
        let listed = |list, column: usize| names::lists(list, &self.stated[column].stem());
        let usages: Vec<usize> = columns
            .clone()
            .filter(|column| listed(names::USAGES, *column) && few(*column))
            .collect();
        let reflectors: Vec<usize> = columns
            .filter(|column| listed(names::REFLECTORS, *column) && few(*column))
            .collect();
        self.map("usage", &usages, None, None);
        self.map(
            "target",
            &reflectors,
            None,
            Some("which of several reflectors was measured?".into())
                .filter(|_| !reflectors.is_empty()),
        );
    }
}
