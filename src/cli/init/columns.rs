//! What a recording's columns seem to hold, by their names and first values: a proposal that a person checks.

use super::names::{Name, joints, point};
use super::quoted;
use crate::error::{Error, Result, counted};
use crate::raw;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Bytes and lines that are looked at.
const LOOKED: u64 = 1 << 20;
const LINES: usize = 400;

/// What columns of points' names are called.
const IDS: [&str; 13] =
    ["point", "point_id", "id", "name", "pose", "nr", "no", "punkt", "messpunkt", "index", "label", "target", "measurement"];

/// A delimited text, as far as it was understood.
pub(super) struct Found {
    delimiter: char,
    comma: bool,
    /// Lines above the header.
    skip: usize,
    pub joints: Vec<String>,
    /// Whether the joints' values go beyond what radians can be.
    degrees: bool,
    /// Whether the name says the unit.
    joint_unit: Option<&'static str>,
    pub id: Option<String>,
    /// A column that says what a row is for, e.g. fit or validate.
    pub usage: Option<String>,
    /// Quantities of each joint, by pattern: motor currents, directions of approach, velocities.
    patterns: Vec<(&'static str, &'static str, Option<&'static str>)>,
    /// x, y, z.
    pub point: Vec<String>,
    point_unit: Option<&'static str>,
    /// Quantity, column, unit, whether the unit was in the name.
    others: Vec<(&'static str, String, &'static str, bool)>,
    unused: Vec<String>,
    /// Largest coordinate found.
    farthest: f64,
}

impl Found {
    pub fn read(path: &Path) -> Result<Self> {
        let place = path.display().to_string();
        let file = raw::open(path).map_err(|error| Error::spec(&place, format!("cannot be read: {error}")))?;
        let mut lines = Vec::new();
        for line in BufReader::new(file.take(LOOKED)).split(b'\n').take(LINES) {
            let line = line.map_err(|error| Error::store(&place, format!("cannot be read: {error}")))?;
            lines.push(String::from_utf8_lossy(&line).trim_end_matches('\r').trim_start_matches('\u{feff}').to_string());
        }
        let delimiter =
            [';', '\t', ',', ' '].into_iter().max_by_key(|c| lines.iter().filter(|line| line.matches(*c).count() >= 3).count());
        let delimiter = delimiter.unwrap_or(',');
        let cells = |line: &String| -> Vec<String> {
            line.split(delimiter)
                .map(|cell| cell.trim().trim_matches('"').to_string())
                .filter(|cell| delimiter != ' ' || !cell.is_empty())
                .collect()
        };
        let number = |text: &String| {
            text.parse::<f64>().ok().or_else(|| (delimiter != ',').then(|| text.replacen(',', ".", 1).parse().ok())?)
        };
        let numeric = |line: &Vec<String>| line.iter().filter(|cell| number(cell).is_some()).count();
        let rows: Vec<Vec<String>> = lines.iter().map(cells).collect();
        // The header is the line of names above the first line of numbers as wide as itself.
        let header = (0..rows.len().saturating_sub(1)).find(|k| {
            let (here, next) = (&rows[*k], &rows[*k + 1]);
            here.len() >= 3 && here.len() == next.len() && numeric(here) == 0 && 2 * numeric(next) >= next.len()
        });
        let Some(skip) = header else {
            return Err(Error::data(
                place,
                "no header found: expected a line of column names above the numbers; put one there, or describe the columns by number in the pipeline",
            ));
        };
        let names = rows[skip].clone();
        let body: Vec<&Vec<String>> = rows[skip + 1..].iter().filter(|row| row.len() == names.len()).collect();
        let values = |column: usize| body.iter().filter_map(move |row| number(&row[column]));
        let largest = |column: usize| values(column).map(f64::abs).fold(0.0, f64::max);
        let comma =
            delimiter != ',' && body.iter().flat_map(|row| row.iter()).any(|cell| cell.contains(',') && number(cell).is_some());
        let mut found = Self {
            delimiter,
            comma,
            skip,
            joints: Vec::new(),
            degrees: false,
            joint_unit: None,
            id: None,
            usage: None,
            patterns: Vec::new(),
            point: Vec::new(),
            point_unit: None,
            others: Vec::new(),
            unused: Vec::new(),
            farthest: 0.0,
        };
        let said: Vec<Name> = names.iter().map(|name| Name::of(name)).collect();
        let mut taken = vec![false; names.len()];
        let filled = |column: usize| !body.is_empty() && values(column).count() == body.len();
        let angle = |column: usize| {
            filled(column) && largest(column) <= 360.0 && said[column].unit.is_none_or(|unit| ["deg", "rad"].contains(&unit))
        };
        for column in joints(&said, angle) {
            taken[column] = true;
            found.degrees |= largest(column) > 6.5;
            found.joint_unit = said[column].unit_of(&["deg", "rad"]);
            found.joints.push(names[column].clone());
        }
        for column in point(&said).into_iter().flatten() {
            taken[column] = true;
            found.farthest = found.farthest.max(largest(column));
            found.point_unit = said[column].unit_of(&["mm", "m", "um", "in"]);
            found.point.push(names[column].clone());
        }
        for (quantity, pattern, unit) in
            [("current", "i{j}_a", Some("A")), ("direction", "dir{j}", None), ("velocity", "dq{j}_deg_s", Some("deg/s"))]
        {
            let column = |n: usize| names.iter().position(|name| *name == pattern.replace("{j}", &n.to_string()));
            let columns: Vec<usize> = (1..).map_while(column).collect();
            if !columns.is_empty() && columns.len() == found.joints.len() {
                columns.iter().for_each(|column| taken[*column] = true);
                found.patterns.push((quantity, pattern, unit));
            }
        }
        for (column, name) in names.iter().enumerate().filter(|(column, _)| !taken[*column]) {
            let (lower, unit) = (said[column].stem(), said[column].unit);
            let is = |words: &[&str]| words.iter().any(|word| lower == *word || lower.starts_with(&format!("{word}_")));
            if found.id.is_none() && is(&IDS) {
                found.id = Some(name.clone());
            } else if found.usage.is_none() && is(&["use", "usage", "set"]) {
                found.usage = Some(name.clone());
            } else if is(&["payload", "load", "mass", "last", "traglast"]) && filled(column) {
                found.others.push(("payload", name.clone(), "kg", unit == Some("kg")));
            } else if is(&["temp", "temperature", "temperatur"]) && filled(column) {
                found.others.push(("temperature", name.clone(), "C", unit == Some("C")));
            } else if is(&["time", "t", "timestamp", "zeit"]) && filled(column) {
                found.others.push(("time", name.clone(), "s", unit == Some("s")));
            } else {
                found.unused.push(name.clone());
            }
        }
        Ok(found)
    }

    /// What was found, for the terminal.
    pub fn account(&self) -> String {
        let mut parts = Vec::new();
        if !self.joints.is_empty() {
            parts.push(format!(
                "{} ({} to {})",
                counted(self.joints.len(), "joint"),
                self.joints[0],
                self.joints[self.joints.len() - 1]
            ));
        }
        if self.point.len() == 3 {
            parts.push(format!("the point ({})", self.point.join(", ")));
        }
        parts.extend(self.id.iter().map(|id| format!("names ({id})")));
        parts.extend(self.usage.iter().map(|usage| format!("usage ({usage})")));
        parts.extend(self.patterns.iter().map(|(quantity, pattern, _)| format!("{quantity} ({pattern})")));
        parts.extend(self.others.iter().map(|(quantity, column, ..)| format!("{quantity} ({column})")));
        if !self.unused.is_empty() {
            parts.push(format!("not used: {}", self.unused.join(", ")));
        }
        parts.join("; ")
    }

    /// The settings of this file under `files`, with lines to replace where no file has the joints, or the point.
    pub fn yaml(&self, missing: [bool; 2]) -> String {
        let mut out = String::new();
        if self.delimiter != ',' {
            out.push_str(&format!("          delimiter: {}\n", quoted(&self.delimiter.to_string())));
        }
        if self.comma {
            out.push_str("          decimal: comma\n");
        }
        if self.skip > 0 {
            out.push_str(&format!("          skip: {}                 # lines above the header\n", self.skip));
        }
        out.push_str("          columns:\n");
        let mut put = |quantity: &str, column: &str, unit: Option<&str>, check: &str| {
            let unit = unit.map(|unit| format!(", unit: {unit}")).unwrap_or_default();
            let check = if check.is_empty() { String::new() } else { format!("   # CHECK: {check}") };
            out.push_str(&format!("            {quantity}: {{column: {}{unit}}}{check}\n", quoted(column)));
        };
        if let Some(id) = &self.id {
            put("point_id", id, None, "");
        }
        if let Some(first) = self.joints.first() {
            let pattern = pattern(first, self.joints.get(1));
            let (unit, why) = match self.joint_unit {
                Some(unit) => (unit, String::new()),
                None if self.degrees => ("deg", "values beyond 6.5 cannot be radians".to_string()),
                None => ("rad", "no value is beyond 6.5; are these degrees?".to_string()),
            };
            put("q", &pattern, Some(unit), &why);
        }
        if let Some(usage) = &self.usage {
            put("usage", usage, None, "");
        }
        for (quantity, pattern, unit) in &self.patterns {
            put(quantity, pattern, *unit, "");
        }
        for (axis, column) in ["x", "y", "z"].iter().zip(&self.point) {
            let (unit, why) = match self.point_unit {
                Some(unit) => (unit, ""),
                None if self.farthest > 50.0 => ("mm", "by the size of the numbers"),
                None => ("m", "by the size of the numbers"),
            };
            put(axis, column, Some(unit), why);
        }
        for (quantity, column, unit, named) in &self.others {
            put(quantity, column, Some(unit), if *named { "" } else { "the unit" });
        }
        if self.joints.is_empty() && missing[0] {
            out.push_str("            q: {column: \"A{j}\", unit: deg}   # REPLACE: no columns of joints were recognised; {j} is the joint's number\n");
        }
        if self.point.len() < 3 && missing[1] {
            for axis in ["x", "y", "z"] {
                out.push_str(&format!(
                    "            {axis}: {{column: {axis}, unit: mm}}   # REPLACE: the measured point was not recognised\n"
                ));
            }
        }
        for column in &self.unused {
            out.push_str(&format!("            # not used: {}\n", quoted(column)));
        }
        out
    }
}

/// The names of all joints in one: the 1 that becomes a 2 in the next name is the joint's number.
fn pattern(first: &str, second: Option<&String>) -> String {
    let ones = first.match_indices('1').map(|(at, _)| format!("{}{{j}}{}", &first[..at], &first[at + 1..]));
    let fits = |pattern: &String| second.is_none_or(|second| pattern.replace("{j}", "2") == *second);
    ones.into_iter().find(fits).unwrap_or_else(|| first.replacen('1', "{j}", 1))
}
