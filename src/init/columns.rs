//! A file of a recording with what its columns are taken to hold, as lines of a pipeline.

use crate::error::first_of;
use crate::init::names;
use crate::init::names::{Name, pattern};
use crate::init::sheet::{Sheet, number};
use crate::yaml::quoted;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Columns that are named where they are not used.
pub(super) const MOST_NAMED: usize = 200;

/// What may stand for one quantity, best first.
pub(super) struct Mapping {
    pub(crate) quantity: &'static str,
    pub(crate) choices: Vec<Choice>,
    pub(crate) check: Option<String>,
    pub(crate) account: String,
}

/// Lines below `columns`, and the columns that they take.
#[derive(Default)]
pub(super) struct Choice {
    pub(crate) lines: Vec<String>,
    /// The line `targets:` of the file, instead.
    pub(crate) targets: Option<String>,
    pub(crate) columns: Vec<usize>,
}

impl Choice {
    pub(crate) fn of(lines: Vec<String>, columns: Vec<usize>) -> Self {
        Self {
            lines,
            columns,
            targets: None,
        }
    }
}

/// A file, as far as it was understood.
pub(super) struct ExaminedFile {
    pub(crate) path: PathBuf,
    pub(crate) name: String,
    pub(crate) sheet: Sheet,
    pub(crate) stated: Vec<Name>,
    /// How many columns are called so.
    named: BTreeMap<String, usize>,
    pub(crate) mappings: Vec<Mapping>,
    /// Seconds in the unit of a time column.
    pub(crate) second: f64,
    pub(crate) remarks: Vec<String>,
}

impl ExaminedFile {
    /// Nothing is known yet of its columns.
    pub(crate) fn unknown(path: &Path, sheet: Sheet) -> Self {
        let file_name = path.file_name().map_or_else(
            || path.display().to_string(),
            |name| name.to_string_lossy().into_owned(),
        );
        let part = |what: &str, part: &Option<String>| {
            part.as_ref()
                .map(|part| format!("{file_name} {what} `{part}`"))
        };
        let name = part("sheet", &sheet.of_book)
            .or_else(|| part("topic", &sheet.topic))
            .unwrap_or_else(|| file_name.clone());
        let mut stated: Vec<Name> = sheet.names.iter().map(|name| Name::of(name)).collect();
        for (name, unit) in stated.iter_mut().zip(&sheet.units) {
            name.unit = name.unit.or(*unit);
        }
        let mut named = BTreeMap::new();
        sheet
            .names
            .iter()
            .for_each(|name| *named.entry(name.clone()).or_insert(0) += 1);
        Self {
            path: path.into(),
            name,
            sheet,
            stated,
            named,
            mappings: Vec::new(),
            second: 1.0,
            remarks: Vec::new(),
        }
    }

    /// Whether a column without a header may name points: texts or whole numbers, each another.
    pub(crate) fn may_be_names(&self, column: usize) -> bool {
        let whole = self
            .sheet
            .texts(column)
            .all(|cell| number(cell).is_none() || !cell.contains(['.', ',']));
        whole && !self.sheet.rows.is_empty() && self.distinct(column) == self.sheet.rows.len()
    }

    pub(crate) fn get(&self, quantity: &str) -> Option<&Mapping> {
        self.mappings
            .iter()
            .find(|mapping| mapping.quantity == quantity)
    }

    pub(crate) fn has(&self, quantity: &str) -> bool {
        self.get(quantity).is_some()
    }

    /// How many columns of joints it has, where it has some.
    pub(crate) fn joint_count(&self) -> Option<usize> {
        Some(self.get("q")?.choices[0].columns.len())
    }

    /// Takes a quantity out and leaves it as a remark.
    pub(crate) fn drop(&mut self, quantity: &str, why: &str) {
        let is_it = |mapping: &Mapping| mapping.quantity == quantity;
        let Some(at) = self.mappings.iter().position(is_it) else {
            return;
        };
        let first = self.mappings.remove(at).choices.into_iter().next();
        let lines = first.map(|choice| choice.targets.into_iter().chain(choice.lines));
        let first = self.remarks.len();
        self.remarks.extend(lines.into_iter().flatten());
        if let Some(line) = self.remarks.get_mut(first) {
            line.push_str(&format!("   # CHECK: {why}"));
        }
    }

    pub(crate) fn account(&self) -> String {
        let mut parts: Vec<String> = self
            .sheet
            .notes
            .iter()
            .chain(&self.sheet.trouble)
            .cloned()
            .collect();
        parts.extend(self.mappings.iter().map(|mapping| mapping.account.clone()));
        let unused = (0..self.stated.len()).filter(|column| !self.is_taken(*column));
        let unused: Vec<&str> = unused.map(|column| &*self.sheet.names[column]).collect();
        if !unused.is_empty() && self.sheet.trouble.is_none() {
            parts.push(format!("not used: {}", first_of(&unused, MOST_NAMED)));
        }
        parts.join("; ")
    }

    /// Gives every row the same text of a quantity.
    pub(crate) fn state(&mut self, quantity: &'static str, value: &str, check: &str) {
        let choice = Choice::of(vec![format!("{quantity}: {{value: {value}}}")], Vec::new());
        let account = format!("{quantity} {value}");
        self.propose(quantity, [choice], [check.into()], account);
    }

    /// Adds what may stand for a quantity, best first, with what is to be looked at.
    pub(crate) fn propose(
        &mut self,
        quantity: &'static str,
        choices: impl IntoIterator<Item = Choice>,
        checks: impl IntoIterator<Item = String>,
        account: String,
    ) {
        let checks: Vec<String> = checks.into_iter().collect();
        self.mappings.push(Mapping {
            quantity,
            choices: choices.into_iter().collect(),
            check: (!checks.is_empty()).then(|| checks.join("; ")),
            account,
        });
    }

    /// Adds a setting to a quantity's line.
    pub(crate) fn add(&mut self, quantity: &str, setting: &str) {
        let mut mappings = self.mappings.iter_mut();
        let mapping = mappings.find(|mapping| mapping.quantity == quantity);
        let choices = mapping.into_iter().flat_map(|mapping| &mut mapping.choices);
        for line in choices.flat_map(|choice| &mut choice.lines) {
            if let Some(open) = line.strip_suffix('}') {
                *line = format!("{open}, {setting}}}");
            }
        }
    }

    pub(crate) fn is_taken(&self, column: usize) -> bool {
        let mut used = self.mappings.iter().filter_map(|one| one.choices.first());
        used.any(|choice| choice.columns.contains(&column))
    }

    /// A column as the pipeline names it: by its number where the name is not its alone.
    pub(crate) fn reference(&self, column: usize) -> String {
        let name = self.sheet.names.get(column).map_or("", String::as_str);
        let alone = self.named.get(name) == Some(&1);
        if name.is_empty() || !alone || name.contains("${") || !self.sheet.header {
            (column + 1).to_string()
        } else {
            quoted(name)
        }
    }

    fn names_of(&self, columns: &[usize]) -> Vec<&str> {
        let columns = columns.iter();
        columns.map(|column| &*self.sheet.names[*column]).collect()
    }

    pub(crate) fn shown(&self, columns: &[usize]) -> String {
        self.names_of(columns).join(", ")
    }

    pub(crate) fn line(&self, quantity: &str, column: usize, unit: Option<&str>) -> String {
        let (column, unit) = (self.reference(column), in_unit(unit));
        format!("{quantity}: {{column: {column}{unit}}}")
    }

    pub(crate) fn lines(
        &self,
        quantities: [&str; 3],
        columns: [usize; 3],
        unit: &str,
    ) -> Vec<String> {
        let each = quantities.iter().zip(columns);
        each.map(|(quantity, column)| self.line(quantity, column, Some(unit)))
            .collect()
    }

    /// Columns as a list of the pipeline.
    pub(crate) fn references(&self, columns: &[usize]) -> String {
        let columns = columns.iter();
        let all: Vec<String> = columns.map(|column| self.reference(*column)).collect();
        format!("[{}]", all.join(", "))
    }

    /// Maps a quantity to single columns, best first.
    pub(crate) fn map(
        &mut self,
        quantity: &'static str,
        columns: &[usize],
        unit: Option<&'static str>,
        check: Option<String>,
    ) {
        let choice =
            |column: &usize| Choice::of(vec![self.line(quantity, *column, unit)], vec![*column]);
        let choices: Vec<Choice> = columns.iter().map(choice).collect();
        let Some(first) = columns.first() else { return };
        let word = if quantity == "point_id" {
            "names"
        } else {
            quantity
        };
        let account = format!("{word} ({})", self.sheet.names[*first]);
        let check =
            check.or_else(|| (columns.len() > 1).then(|| "several columns fit".to_string()));
        self.propose(quantity, choices, check, account);
    }

    /// A pattern where the names follow one, else a list.
    pub(crate) fn joints_line(
        &self,
        quantity: &str,
        columns: &[usize],
        unit: Option<&str>,
    ) -> String {
        let (unit, names) = (in_unit(unit), self.names_of(columns));
        let alone = |column: &usize| self.reference(*column).starts_with('"');
        // A pattern stands for all that are called so.
        let next = (names.len() + 1).to_string();
        let more = |pattern: &String| self.named.contains_key(&pattern.replace("{j}", &next));
        let pattern = pattern(&names).filter(|_| columns.iter().all(alone));
        let columns = match pattern.filter(|pattern| !more(pattern)) {
            Some(pattern) => format!("column: {}", quoted(&pattern)),
            None => format!("columns: {}", self.references(columns)),
        };
        format!("{quantity}: {{{columns}{unit}}}")
    }

    /// Proposes rows of columns, one column a joint, best first.
    pub(crate) fn propose_joints(
        &mut self,
        quantity: &'static str,
        rows: &[Vec<usize>],
        unit: Option<&str>,
        checks: impl IntoIterator<Item = String>,
        what: &str,
    ) {
        let choice = |columns: &Vec<usize>| {
            let line = self.joints_line(quantity, columns, unit);
            Choice::of(vec![line], columns.clone())
        };
        let choices: Vec<Choice> = rows.iter().map(choice).collect();
        let ends = [rows[0].first(), rows[0].last()].into_iter().flatten();
        let ends: Vec<usize> = ends.copied().collect();
        let account = format!("{what} ({})", self.names_of(&ends).join(" to "));
        self.propose(quantity, choices, checks, account);
    }

    pub(crate) fn distinct(&self, column: usize) -> usize {
        self.sheet.texts(column).collect::<BTreeSet<_>>().len()
    }

    /// Columns that may name points by their header, whole, best first: texts before numbers, each of different cells.
    pub(crate) fn ids(&self) -> Vec<usize> {
        let rows = self.sheet.rows.len();
        let named = |column: &usize| {
            let stem = self.stated[*column].stem();
            let name = self.sheet.names[*column].trim();
            let ends = stem.ends_with("_id")
                || stem.ends_with("_name")
                || ["#", "n\u{b0}", "n\u{ba}"].contains(&name);
            let whole = self.sheet.texts(*column).count() == rows;
            let first = !self.sheet.header && *column == 0 && self.may_be_names(0);
            (names::lists(names::IDS, &stem) || ends || first) && whole && !self.is_taken(*column)
        };
        let mut columns: Vec<usize> = (0..self.stated.len()).filter(named).collect();
        let rank = |column: usize| (self.distinct(column) < rows, self.sheet.is_numeric(column));
        columns.sort_by_key(|column| rank(*column));
        let best = columns.first().map(|column| rank(*column));
        columns.retain(|column| Some(rank(*column)) == best);
        columns
    }
}

/// The setting behind a column, where there is one.
fn in_unit(unit: Option<&str>) -> String {
    unit.map_or_else(String::new, |unit| format!(", unit: {unit}"))
}

/// Columns of x, y and z under one name, and what the name says of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Family {
    pub(crate) columns: [usize; 3],
    pub(crate) words: Vec<String>,
    pub(crate) role: PointRole,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PointRole {
    Measured,
    /// The name does not say.
    Plain,
    Wanted,
    Difference,
    Sigma,
}

/// A way to the measured point.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PointColumns {
    pub(crate) columns: [usize; 3],
    /// Columns of the difference, and whether they are taken off.
    pub(crate) difference: Option<([usize; 3], bool)>,
}

/// Ways to the measured point, best first; what to ask where it is not plain; what else is known of points.
#[derive(Debug, Clone, Default)]
pub(super) struct Points {
    pub(crate) ways: Vec<PointColumns>,
    pub(crate) question: Option<String>,
    /// Whether the name of the best one says that it was measured.
    pub(crate) is_stated: bool,
    /// Points of several targets side by side, by the targets' names; none where the names do not say so.
    pub(crate) targets: Vec<(String, [usize; 3])>,
    pub(crate) wanted: Option<[usize; 3]>,
    pub(crate) sigma: Option<[usize; 3]>,
}

/// All coordinates that come in threes.
pub(super) fn families(names: &[Name]) -> Vec<Family> {
    let mut groups: BTreeMap<Vec<String>, [Vec<usize>; 3]> = BTreeMap::new();
    for (column, name) in names.iter().enumerate() {
        let Some((axis, mut remainder)) = name.axis() else {
            continue;
        };
        remainder.sort();
        groups.entry(remainder).or_default()[axis].push(column);
    }
    let mut found = Vec::new();
    for (words, [x, y, z]) in groups {
        // Names that stand twice make two points.
        for ((x, y), z) in x.iter().zip(&y).zip(&z) {
            found.push(Family {
                columns: [*x, *y, *z],
                role: role(&words),
                words: words.clone(),
            });
        }
    }
    found.sort_by_key(|family| family.columns[0]);
    found
}

fn role(words: &[String]) -> PointRole {
    let has = |list| words.iter().any(|word| names::lists(list, word));
    match (
        has(names::SIGMA),
        has(names::DIFFERENCE),
        has(names::MEASURED),
        has(names::WANTED),
    ) {
        (true, ..) => PointRole::Sigma,
        (_, true, ..) => PointRole::Difference,
        (_, _, true, false) => PointRole::Measured,
        (_, _, false, true) => PointRole::Wanted,
        _ => PointRole::Plain,
    }
}

/// The measured point among them.
pub(super) fn points(names: &[Name]) -> Points {
    let mut families = families(names);
    // `x_t` next to `x_dif` is the target; alone it may be the tracker's.
    let others = families
        .iter()
        .any(|family| family.role == PointRole::Difference || family.words.is_empty());
    for family in &mut families {
        if family.role == PointRole::Plain && family.words == ["t"] && others {
            family.role = PointRole::Wanted;
        }
    }
    let [measured, plain, wanted, differences, sigma] = [
        PointRole::Measured,
        PointRole::Plain,
        PointRole::Wanted,
        PointRole::Difference,
        PointRole::Sigma,
    ]
    .map(|role| -> Vec<&Family> {
        let of_role = families.iter().filter(|family| family.role == role);
        of_role.collect()
    });
    let direct = |family: &&Family| PointColumns {
        columns: family.columns,
        difference: None,
    };
    let by = |target: &Family, difference: &Family| {
        let mut words = difference.words.iter();
        let minus = words.any(|word| names::lists(names::TARGET_LESS_MEASURED, word));
        PointColumns {
            columns: target.columns,
            difference: Some((difference.columns, minus)),
        }
    };
    let sides = "minus: target less measured point; plus: measured point less target";
    let mut found = Points {
        wanted: wanted.first().map(|family| family.columns),
        sigma: sigma.first().map(|family| family.columns),
        is_stated: !measured.is_empty(),
        ..Points::default()
    };
    let candidates = if measured.is_empty() {
        &plain
    } else {
        &measured
    };
    found.ways = candidates.iter().map(direct).collect();
    if candidates.len() > 1 {
        found.targets = targets(candidates);
        found.question = Some("several points fit; which one was measured?".into());
    } else if measured.is_empty() && !plain.is_empty() {
        if let (Some(difference), true) = (differences.first(), wanted.is_empty()) {
            found.ways.push(by(plain[0], difference));
            found.question = Some(format!(
                "is this the measured point, or the target of the differences next to it ({sides})?"
            ));
        } else if !plain[0].words.is_empty() && wanted.is_empty() {
            found.question = Some("is this the measured point, or the target?".into());
        }
    } else if candidates.is_empty()
        && let (Some(target), false) = (wanted.first(), differences.is_empty())
    {
        let ways = differences.iter().map(|difference| by(target, difference));
        found.ways = ways.collect();
        found.question = Some(format!(
            "the measured point by its target and the difference ({sides})"
        ));
    }
    found
}

/// Several points whose names differ in a number, or in a letter behind a word, alone: `X1` and `X2`, `SMR1_x` and `SMR2_x`.
fn targets(candidates: &[&Family]) -> Vec<(String, [usize; 3])> {
    let (mut named, mut stems) = (Vec::new(), Vec::new());
    for family in candidates {
        // In the order of the name: the words of a family are sorted, and numbers come first.
        let mut words: Vec<&str> = family.words.iter().map(String::as_str).collect();
        words.sort_by_key(|word| word.bytes().all(|byte| byte.is_ascii_digit()));
        let name = words.concat();
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let letter = name
            .strip_suffix(|c: char| c.is_ascii_alphabetic())
            .filter(|stem| stem.len() > 1);
        let stem = Some(stem).filter(|stem| stem.len() < name.len());
        let Some(stem) = stem.or(letter).map(String::from) else {
            return Vec::new();
        };
        let name = match stem.as_str() {
            "" => format!("target_{name}"),
            _ => name,
        };
        named.push((name, family.columns));
        stems.push(stem);
    }
    let names: BTreeSet<&String> = named.iter().map(|(name, _)| name).collect();
    let alike = stems.windows(2).all(|pair| pair[0] == pair[1]) && names.len() == named.len();
    if alike { named } else { Vec::new() }
}
