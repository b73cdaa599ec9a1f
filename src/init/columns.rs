//! What a recording's columns seem to hold, by their names and values: a proposal that a person checks.

use super::names::{LENGTHS, Name, joints, pattern};
use super::points::{PointColumns, Points, points};
use super::reading::tables;
use super::sheet::{Sheet, number};
use super::words;
use crate::error::Result;
use crate::stage::ingest::is_clock_time;
use crate::yaml::quoted;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// No angle in rad is beyond this.
const MOST_RADIANS: f64 = 6.5;
/// Columns that are named where they are not used.
pub(super) const MOST_NAMED: usize = 200;
/// Beyond this coordinates are millimetres, by the size of robots.
const MOST_METRES: f64 = 50.0;

/// What may stand for one quantity, best first.
pub(super) struct Mapping {
    pub quantity: &'static str,
    pub choices: Vec<Choice>,
    /// What to look at.
    pub check: Option<String>,
    /// For the terminal.
    pub account: String,
}

/// Lines below `columns`, and the columns that they take.
pub(super) struct Choice {
    pub lines: Vec<String>,
    /// A line beside `columns` instead.
    pub beside: Option<String>,
    pub columns: Vec<usize>,
}

impl Choice {
    fn of(lines: Vec<String>, columns: Vec<usize>) -> Self {
        Self { lines, columns, beside: None }
    }
}

/// A file, as far as it was understood.
pub(super) struct ExaminedFile {
    pub path: PathBuf,
    /// As messages name it.
    pub name: String,
    pub sheet: Sheet,
    pub said: Vec<Name>,
    /// How many columns are called so.
    named: BTreeMap<String, usize>,
    pub mappings: Vec<Mapping>,
    /// Seconds in the unit of a time column.
    pub second: f64,
    /// Lines of comment.
    pub remarks: Vec<String>,
}

impl ExaminedFile {
    /// The tables of a file, of which there is place for so many.
    pub fn read(path: &Path, places: usize) -> Result<Vec<Self>> {
        Ok(tables(path, places)?.into_iter().map(|sheet| Self::of(path, sheet)).collect())
    }

    fn of(path: &Path, sheet: Sheet) -> Self {
        let own = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
        let name = sheet.of_book.as_ref().map_or(own.clone(), |sheet| format!("{own} sheet `{sheet}`"));
        let mut said: Vec<Name> = sheet.names.iter().map(|name| Name::of(name)).collect();
        for (name, unit) in said.iter_mut().zip(&sheet.units) {
            name.unit = name.unit.or(*unit);
        }
        let mut named = BTreeMap::new();
        sheet.names.iter().for_each(|name| *named.entry(name.clone()).or_insert(0) += 1);
        let mut found =
            Self { path: path.into(), name, sheet, said, named, mappings: Vec::new(), second: 1.0, remarks: Vec::new() };
        if !found.sheet.header {
            found.bare();
        } else if found.sheet.trouble.is_none() {
            found.joints();
            found.point();
            found.per_joint();
            found.scalars();
            found.time();
            found.texts();
        }
        found
    }

    /// A list of points, or of joints, without a header: perhaps names, then three lengths, or six or seven angles.
    fn bare(&mut self) {
        let width = self.sheet.names.len();
        let named = usize::from(self.may_be_names(0) && [4, 7, 8].contains(&width));
        let columns: Vec<usize> = (named..width).collect();
        if !columns.iter().all(|column| self.sheet.is_numeric(*column)) {
            return;
        }
        let most = columns.iter().map(|column| self.sheet.largest(*column)).fold(0.0, f64::max);
        let check = "no header says so; is it right?";
        let mapping = match columns[..] {
            [x, y, z] => {
                let unit = self.length_unit(&[x, y, z]).0;
                let lines = ["x", "y", "z"].iter().zip([x, y, z]).map(|(name, column)| self.line(name, column, Some(unit)));
                let account = format!("the point ({})", self.shown(&columns));
                Mapping {
                    quantity: "x",
                    choices: vec![Choice::of(lines.collect(), columns.clone())],
                    check: Some(check.into()),
                    account,
                }
            }
            [_, _, _, _, _, _] | [_, _, _, _, _, _, _] if most <= 400.0 => {
                let unit = if most > MOST_RADIANS { "deg" } else { "rad" };
                let lines = vec![self.joints_line("q", &columns, Some(unit))];
                let account = format!("{} joints ({})", columns.len(), self.shown(&columns));
                Mapping { quantity: "q", choices: vec![Choice::of(lines, columns.clone())], check: Some(check.into()), account }
            }
            _ => return,
        };
        self.sheet.trouble = None;
        self.mappings.push(mapping);
    }

    /// Whether a column without a header may name points: texts or whole numbers, each another.
    fn may_be_names(&self, column: usize) -> bool {
        let whole = self.sheet.texts(column).all(|cell| number(cell).is_none() || !cell.contains(['.', ',']));
        whole && !self.sheet.rows.is_empty() && self.distinct(column) == self.sheet.rows.len()
    }

    pub fn get(&self, quantity: &str) -> Option<&Mapping> {
        self.mappings.iter().find(|mapping| mapping.quantity == quantity)
    }

    /// Takes a quantity out and leaves it as a remark.
    pub fn drop(&mut self, quantity: &str, why: &str) {
        if let Some(at) = self.mappings.iter().position(|mapping| mapping.quantity == quantity) {
            let dropped = self.mappings.remove(at);
            let lines = dropped.choices.first().map(|choice| choice.beside.iter().chain(&choice.lines).cloned().collect());
            let lines: Vec<String> = lines.unwrap_or_default();
            self.remarks.extend(
                lines
                    .into_iter()
                    .zip([why].into_iter().chain(std::iter::repeat("")))
                    .map(|(line, why)| if why.is_empty() { line } else { format!("{line}   # CHECK: {why}") }),
            );
        }
    }

    /// What was found, for the terminal.
    pub fn account(&self) -> String {
        let mut parts: Vec<String> = self.sheet.trouble.iter().cloned().collect();
        parts.extend(self.mappings.iter().map(|mapping| mapping.account.clone()));
        let unused = (0..self.said.len()).filter(|column| !self.is_taken(*column)).collect::<Vec<usize>>();
        if !unused.is_empty() && self.sheet.trouble.is_none() {
            let more = if unused.len() > MOST_NAMED { format!(" and {} more", unused.len() - MOST_NAMED) } else { String::new() };
            parts.push(format!("not used: {}{more}", self.shown(&unused[..unused.len().min(MOST_NAMED)])));
        }
        parts.join("; ")
    }

    /// Gives every row the same text of a quantity.
    pub fn state(&mut self, quantity: &'static str, value: &str, check: &str) {
        let choice = Choice::of(vec![format!("{quantity}: {{value: {value}}}")], Vec::new());
        let account = format!("{quantity} {value}");
        self.mappings.push(Mapping { quantity, choices: vec![choice], check: Some(check.into()), account });
    }

    /// Adds a setting to a quantity's line.
    pub fn add(&mut self, quantity: &str, setting: &str) {
        let mapping = self.mappings.iter_mut().find(|mapping| mapping.quantity == quantity);
        for line in mapping.into_iter().flat_map(|mapping| &mut mapping.choices).flat_map(|choice| &mut choice.lines) {
            if let Some(open) = line.strip_suffix('}') {
                *line = format!("{open}, {setting}}}");
            }
        }
    }

    pub fn is_taken(&self, column: usize) -> bool {
        self.mappings.iter().any(|mapping| mapping.choices.first().is_some_and(|choice| choice.columns.contains(&column)))
    }

    /// A column as the pipeline names it: by its number where the name is not its alone.
    pub fn reference(&self, column: usize) -> String {
        let name = self.sheet.names.get(column).map_or("", String::as_str);
        let alone = self.named.get(name) == Some(&1);
        if name.is_empty() || !alone || name.contains("${") || !self.sheet.header {
            (column + 1).to_string()
        } else {
            quoted(name)
        }
    }

    fn shown(&self, columns: &[usize]) -> String {
        columns.iter().map(|column| self.sheet.names[*column].as_str()).collect::<Vec<_>>().join(", ")
    }

    pub fn line(&self, quantity: &str, column: usize, unit: Option<&str>) -> String {
        let unit = unit.map(|unit| format!(", unit: {unit}")).unwrap_or_default();
        format!("{quantity}: {{column: {}{unit}}}", self.reference(column))
    }

    /// Maps a quantity to single columns, best first.
    pub fn map(&mut self, quantity: &'static str, columns: &[usize], unit: Option<&'static str>, check: Option<String>) {
        let choice = |column: &usize| Choice::of(vec![self.line(quantity, *column, unit)], vec![*column]);
        let Some(first) = columns.first() else { return };
        let word = if quantity == "point_id" { "names" } else { quantity };
        let account = format!("{word} ({})", self.sheet.names[*first]);
        let check = check.or_else(|| (columns.len() > 1).then(|| "several columns fit".to_string()));
        self.mappings.push(Mapping { quantity, choices: columns.iter().map(choice).collect(), check, account });
    }

    fn joints(&mut self) {
        let angle = |column: usize| {
            self.sheet.is_numeric(column)
                && self.sheet.largest(column) <= 400.0
                && self.said[column].unit.is_none_or(|unit| ["deg", "rad"].contains(&unit))
        };
        let mut rows = joints(&self.said, angle);
        rows.retain(|columns| columns.iter().all(|column| self.sheet.is_numeric(*column)));
        let Some(best) = rows.first() else { return };
        let degrees = best.iter().any(|column| self.sheet.largest(*column) > MOST_RADIANS);
        let named = self.said[best[0]].unit_of(&["deg", "rad"]);
        let (unit, why) = match named {
            Some(unit) => (unit, None),
            None if degrees => ("deg", Some("values beyond 6.5 cannot be radians".to_string())),
            None => ("rad", Some("no value is beyond 6.5; are these degrees?".to_string())),
        };
        let several = (rows.len() > 1).then(|| "several columns of joints fit".to_string());
        let check: Vec<String> = several.into_iter().chain(why).collect();
        let account =
            format!("{} joints ({} to {})", best.len(), self.sheet.names[best[0]], self.sheet.names[best[best.len() - 1]]);
        let choice = |columns: &Vec<usize>| Choice::of(vec![self.joints_line("q", columns, Some(unit))], columns.clone());
        let mapping = Mapping {
            quantity: "q",
            choices: rows.iter().map(choice).collect(),
            check: (!check.is_empty()).then(|| check.join("; ")),
            account,
        };
        self.mappings.push(mapping);
    }

    /// A pattern where the names follow one, else a list.
    fn joints_line(&self, quantity: &str, columns: &[usize], unit: Option<&str>) -> String {
        let unit = unit.map(|unit| format!(", unit: {unit}")).unwrap_or_default();
        let names: Vec<&str> = columns.iter().map(|column| self.sheet.names[*column].as_str()).collect();
        let alone = columns.iter().all(|column| self.reference(*column).starts_with('"'));
        match pattern(&names).filter(|_| alone) {
            Some(pattern) => format!("{quantity}: {{column: {}{unit}}}", quoted(&pattern)),
            None => {
                let list: Vec<String> = columns.iter().map(|column| self.reference(*column)).collect();
                format!("{quantity}: {{columns: [{}]{unit}}}", list.join(", "))
            }
        }
    }

    fn point(&mut self) {
        let found = points(&self.said);
        if found.targets.iter().flat_map(|(_, columns)| columns).all(|column| self.sheet.holds_numbers(*column))
            && let Some(mapping) = self.targets(&found)
        {
            self.mappings.push(mapping);
            return;
        }
        let numeric = |way: &PointColumns| {
            let more = way.difference.iter().flat_map(|(columns, _)| columns);
            way.columns.iter().chain(more).all(|column| self.sheet.is_numeric(*column))
        };
        let ways: Vec<&PointColumns> = found.ways.iter().filter(|way| numeric(way)).collect();
        let Some(best) = ways.first() else {
            if let Some(wanted) = found.wanted {
                self.remarks.push(format!("only a target is there, no measured point: {}", quoted(&self.shown(&wanted))));
            }
            return;
        };
        if let Some(sigma) = found.sigma {
            // In the unit of the point, unless the name says another.
            let unit = self.said[sigma[0]].unit_of(&LENGTHS).unwrap_or(self.length_unit(&best.columns).0);
            let (names, what) = match self.said[sigma[0]].stem().contains(words::U95) {
                true => (["u95_x", "u95_y", "u95_z"], "two standard deviations"),
                false => (["sigma_x", "sigma_y", "sigma_z"], "one standard deviation"),
            };
            let lines = names.iter().zip(sigma).map(|(name, column)| self.line(name, column, Some(unit)));
            let lines: Vec<String> = lines.collect();
            self.remarks.push(format!("{}   # CHECK: {what}, if rows are to be weighted by it", lines[0]));
            self.remarks.extend(lines.into_iter().skip(1));
        }
        let by_size = self.length_unit(&best.columns).1.then(|| "the unit, by the size of the numbers".to_string());
        let check: Vec<String> = found.question.into_iter().chain(by_size).collect();
        let said = if found.said { "the measured point" } else { "the point" };
        let less =
            best.difference.map(|(columns, minus)| format!("; {} {}", if minus { "less" } else { "plus" }, self.shown(&columns)));
        let less = less.unwrap_or_default();
        let mapping = Mapping {
            quantity: "x",
            choices: ways.iter().map(|way| self.way(way)).collect(),
            check: (!check.is_empty()).then(|| check.join("; ")),
            account: format!("{said} ({}{less})", self.shown(&best.columns)),
        };
        self.mappings.push(mapping);
    }

    /// Several targets side by side, or one of them alone.
    fn targets(&self, found: &Points) -> Option<Mapping> {
        let unit = self.length_unit(&found.targets.first()?.1).0;
        let one = |(name, columns): &(String, [usize; 3])| {
            format!("{name}: [{}]", columns.each_ref().map(|column| self.reference(*column)).join(", "))
        };
        let all: Vec<String> = found.targets.iter().map(one).collect();
        let columns = found.targets.iter().flat_map(|(_, columns)| *columns).collect();
        let beside = Some(format!("targets: {{unit: {unit}, columns: {{{}}}}}", all.join(", ")));
        let choices =
            [Choice { lines: Vec::new(), columns, beside }].into_iter().chain(found.ways.iter().map(|way| self.way(way)));
        let names: Vec<&str> = found.targets.iter().map(|(name, _)| name.as_str()).collect();
        Some(Mapping {
            quantity: "x",
            choices: choices.collect(),
            check: Some("are these several reflectors, each measured in every pose, and is the unit right?".into()),
            account: format!("the points of {} targets ({})", names.len(), names.join(", ")),
        })
    }

    fn way(&self, way: &PointColumns) -> Choice {
        let unit = self.length_unit(&way.columns).0;
        let mut columns = way.columns.to_vec();
        let lines = ["x", "y", "z"].iter().enumerate().map(|(axis, name)| match &way.difference {
            None => self.line(name, way.columns[axis], Some(unit)),
            Some((difference, minus)) => {
                let (key, column) = (if *minus { "minus" } else { "plus" }, difference[axis]);
                let other = self.said[column].unit_of(&LENGTHS).filter(|other| *other != unit);
                let other = other.map(|other| format!(", difference_unit: {other}")).unwrap_or_default();
                let (target, column) = (self.reference(way.columns[axis]), self.reference(column));
                format!("{name}: {{column: {target}, {key}: {column}, unit: {unit}{other}}}")
            }
        });
        let lines = lines.collect();
        columns.extend(way.difference.iter().flat_map(|(columns, _)| columns));
        Choice::of(lines, columns)
    }

    /// The unit of coordinates, and whether their size alone says so.
    fn length_unit(&self, columns: &[usize; 3]) -> (&'static str, bool) {
        if let Some(unit) = columns.iter().find_map(|column| self.said[*column].unit_of(&LENGTHS)) {
            return (unit, false);
        }
        let farthest = columns.iter().map(|column| self.sheet.largest(*column)).fold(0.0, f64::max);
        (if farthest > MOST_METRES { "mm" } else { "m" }, true)
    }

    /// Motor currents, directions of approach and velocities under calib's own names.
    fn per_joint(&mut self) {
        let Some(count) = self.get("q").map(|joints| joints.choices[0].columns.len()) else { return };
        for (quantity, pattern, unit) in
            [("current", "i{j}_a", Some("A")), ("direction", "dir{j}", None), ("velocity", "dq{j}_deg_s", Some("deg/s"))]
        {
            let column = |n: usize| self.sheet.names.iter().position(|name| *name == pattern.replace("{j}", &n.to_string()));
            let columns: Vec<usize> = (1..).map_while(column).collect();
            if columns.len() == count {
                let lines = vec![self.joints_line(quantity, &columns, unit)];
                let account = format!("{quantity} ({pattern})");
                self.mappings.push(Mapping { quantity, choices: vec![Choice::of(lines, columns)], check: None, account });
            }
        }
    }

    fn scalars(&mut self) {
        for (quantity, listed, unit, most) in
            [("payload", &words::PAYLOADS[..], "kg", 1e4), ("temperature", &words::TEMPERATURES[..], "C", 200.0)]
        {
            let fits = |column: &usize| {
                let name = &self.said[*column];
                let named = if quantity == "payload" { listed.contains(&name.stem().as_str()) } else { name.is(listed) };
                let plausible = self.sheet.is_numeric(*column) && self.sheet.largest(*column) <= most;
                named && plausible && !self.is_taken(*column) && name.unit.is_none_or(|other| other == unit)
            };
            let columns: Vec<usize> = (0..self.said.len()).filter(fits).collect();
            let Some(first) = columns.first() else { continue };
            let check = (self.said[*first].unit.is_none()).then(|| "the unit".to_string());
            self.map(quantity, &columns, Some(unit), check);
        }
    }

    fn time(&mut self) {
        let named = |column: &usize| self.said[*column].is(&words::TIMES) && !self.is_taken(*column);
        let unit = |column: usize| match self.said[column].unit {
            None => Some((if self.sheet.largest(column) > 1e11 { "ms" } else { "s" }, false)),
            Some(unit) => Some((unit, true)).filter(|(unit, _)| ["s", "ms"].contains(unit)),
        };
        let columns: Vec<usize> = (0..self.said.len()).filter(named).collect();
        let running: Vec<usize> =
            columns.iter().copied().filter(|column| unit(*column).is_some() && self.runs(*column)).collect();
        let is_clock = |column: &usize| {
            let mut texts = self.sheet.texts(*column).filter(|text| !text.is_empty()).peekable();
            texts.peek().is_some() && texts.all(is_clock_time)
        };
        let clocks: Vec<usize> = columns.iter().copied().filter(is_clock).collect();
        for column in columns.iter().filter(|column| !running.contains(column) && !clocks.contains(column)) {
            let name = quoted(&self.sheet.names[*column]);
            self.remarks.push(format!(
                "{name} cannot be read as time; allowed: s or ms as numbers that never decrease, 08:15:03, or 2026-11-22T08:15:03"
            ));
        }
        let Some((unit, said)) = running.first().and_then(|column| unit(*column)) else {
            self.map("time", &clocks, Some("clock"), None);
            return;
        };
        self.second = if unit == "ms" { 1e-3 } else { 1.0 };
        self.map("time", &running, Some(unit), (!said).then(|| "the unit".to_string()));
    }

    /// Whether numbers do not fall, do not stand still, and are no dates in digits (20201103154500).
    fn runs(&self, column: usize) -> bool {
        let times: Vec<f64> = self.sheet.numbers(column).collect();
        let falls = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        let dates = times.iter().all(|time| (1.9e13..2.2e13).contains(time));
        let moves = times.first().zip(times.last()).is_some_and(|(first, last)| last > first);
        self.sheet.is_numeric(column) && moves && !dates && 20 * falls <= times.len()
    }

    /// What rows are for, which reflector they measured, and what points are called in a file that stands alone.
    fn texts(&mut self) {
        let columns = 0..self.said.len();
        let few = |column: usize| {
            let distinct = self.distinct(column);
            (2..=10).contains(&distinct) && 3 * distinct <= self.sheet.rows.len() && !self.sheet.is_numeric(column)
        };
        let listed = |listed: &[&str], column: usize| listed.contains(&self.said[column].stem().as_str());
        let usages: Vec<usize> = columns.clone().filter(|column| listed(&words::USAGES, *column) && few(*column)).collect();
        let reflectors: Vec<usize> = columns.filter(|column| listed(&words::REFLECTORS, *column) && few(*column)).collect();
        self.map("usage", &usages, None, None);
        self.map(
            "target",
            &reflectors,
            None,
            Some("which of several reflectors was measured?".into()).filter(|_| !reflectors.is_empty()),
        );
    }

    pub fn distinct(&self, column: usize) -> usize {
        self.sheet.texts(column).collect::<std::collections::BTreeSet<_>>().len()
    }

    /// Columns that may name points by their header, whole, best first: texts before numbers, each of different cells.
    pub fn ids(&self) -> Vec<usize> {
        let rows = self.sheet.rows.len();
        let named = |column: &usize| {
            let stem = self.said[*column].stem();
            let name = self.sheet.names[*column].trim();
            let ends = stem.ends_with("_id") || stem.ends_with("_name") || ["#", "n\u{b0}", "n\u{ba}"].contains(&name);
            let whole = self.sheet.texts(*column).count() == rows;
            let first = !self.sheet.header && *column == 0 && self.may_be_names(0);
            (words::IDS.contains(&stem.as_str()) || ends || first) && whole && !self.is_taken(*column)
        };
        let mut columns: Vec<usize> = (0..self.said.len()).filter(named).collect();
        let rank = |column: usize| (self.distinct(column) < rows, self.sheet.is_numeric(column));
        columns.sort_by_key(|column| rank(*column));
        let best = columns.first().map(|column| rank(*column));
        columns.retain(|column| Some(rank(*column)) == best);
        columns
    }
}
