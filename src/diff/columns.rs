//! Which column of A is compared with which of B, how, and with what tolerance: from the schema, the files and the options.

use std::collections::BTreeSet;

use super::source::{CellKind, TableColumn, TableFile};
use super::{DiffOptions, Discrepancy, Tolerances};
use crate::error::{Error, Result, did_you_mean};
use crate::units::{Quantity, Unit};

/// Columns of A and of B that hold the same.
#[derive(Debug, Clone)]
pub(super) struct ColumnPair {
    /// As A calls it.
    pub(crate) name: String,
    pub(crate) a: Vec<usize>,
    pub(crate) b: Vec<usize>,
    pub(crate) how: Comparator,
    /// Unit of the difference; empty where there is none, `row` where every row has its own.
    pub(crate) unit: String,
    /// B's values are multiplied by the first and added to the second, so that they are in A's unit.
    pub(crate) conversion: (f64, f64),
    pub(crate) atol: f64,
    pub(crate) rtol: f64,
    /// Columns with one standard deviation of the values, in A and in B.
    pub(crate) sigma: Option<(usize, usize)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Comparator {
    Number,
    /// Modulo a turn, which is given in the column's unit.
    Angle(f64),
    /// Four columns w, x, y, z; the difference is the angle of the rotation between, in rad.
    Quaternion,
    /// Three columns; the difference is the angle of the rotation between, in rad. The factor makes radians.
    RotationVector(f64),
    Text,
}

/// Pairs the columns that are no key; what has no partner or another unit becomes a finding.
pub(super) fn plan(
    a: &TableFile,
    b: &TableFile,
    key: &[String],
    options: &DiffOptions,
    findings: &mut Vec<Discrepancy>,
) -> Result<Vec<ColumnPair>> {
    known_names(a, b, options)?;
    let ignored = |name: &String| key.contains(name) || options.ignore.contains(name);
    let mut pairs = Pairs {
        a,
        b,
        options,
        used_a: BTreeSet::new(),
        used_b: BTreeSet::new(),
        findings,
    };
    let mut comparisons = Vec::new();
    for (names, vector) in groups(a, options) {
        if !names.iter().any(ignored) {
            comparisons.extend(pairs.rotation(&names, vector));
        }
    }
    for (at_a, column) in a.columns.iter().enumerate() {
        if !pairs.used_a.contains(&at_a) && !ignored(&column.name) {
            comparisons.extend(pairs.column(at_a));
        }
    }
    for (at_b, column) in b.columns.iter().enumerate() {
        if !pairs.used_b.contains(&at_b) && !ignored(&column.name) {
            pairs
                .findings
                .push(Discrepancy::new("column", &column.name, "only in B"));
        }
    }
    comparisons.sort_by_key(|comparison| comparison.a[0]);
    Ok(comparisons)
}

/// Columns that have found their partner so far.
struct Pairs<'p> {
    a: &'p TableFile,
    b: &'p TableFile,
    options: &'p DiffOptions,
    used_a: BTreeSet<usize>,
    used_b: BTreeSet<usize>,
    findings: &'p mut Vec<Discrepancy>,
}

impl Pairs<'_> {
    /// Columns that are one rotation: a rotation vector, or a quaternion. None where one of the files lacks some of them.
    fn rotation(&mut self, names: &[String], vector: bool) -> Option<ColumnPair> {
        let at = |source: &TableFile| {
            names
                .iter()
                .map(|name| source.position(name))
                .collect::<Option<Vec<usize>>>()
        };
        let (at_a, at_b) = (at(self.a)?, at(self.b)?);
        self.used_a.extend(&at_a);
        self.used_b.extend(&at_b);
        let factor = angle_unit(self.a, at_a[0]).map_or(1.0, |unit| unit.to_si(1.0));
        let how = if vector {
            Comparator::RotationVector(factor)
        } else {
            Comparator::Quaternion
        };
        let (atol, rtol) = tolerance(self.a, &names[0], self.options, Unit::Radian);
        Some(ColumnPair {
            name: names.join(","),
            a: at_a,
            b: at_b,
            how,
            unit: "rad".into(),
            conversion: (1.0, 0.0),
            atol,
            rtol,
            sigma: None,
        })
    }

    /// A column of A with its counterpart in B. None where there is none, or one of another quantity.
    fn column(&mut self, at_a: usize) -> Option<ColumnPair> {
        let (a, b) = (self.a, self.b);
        let column = &a.columns[at_a];
        let Some(at_b) = counterpart(a, b, at_a, &self.used_b) else {
            self.say("column", column, "only in A");
            return None;
        };
        self.used_b.insert(at_b);
        let theirs = &b.columns[at_b];
        self.kinds_apart(column, theirs);
        let unit_a = unit(a, at_a);
        let conversion = self.conversion((column, unit_a), (theirs, unit(b, at_b)))?;
        let text = column.kind == CellKind::Text || theirs.kind == CellKind::Text;
        let how = match (text, turn(a, at_a)) {
            (true, _) => Comparator::Text,
            (false, Some(turn)) => Comparator::Angle(turn),
            (false, None) => Comparator::Number,
        };
        let (atol, mut rtol) =
            tolerance(a, &column.name, self.options, unit_a.unwrap_or(Unit::One));
        if conversion != (1.0, 0.0) {
            rtol = rtol.max(CONVERTED);
        }
        let symbol = column
            .unit
            .clone()
            .or_else(|| unit_a.map(|unit| unit.symbol().to_string()))
            .unwrap_or_default();
        Some(ColumnPair {
            name: column.name.clone(),
            a: vec![at_a],
            b: vec![at_b],
            how,
            unit: if symbol == "1" { String::new() } else { symbol },
            conversion,
            atol,
            rtol,
            sigma: sigma(a, b, &column.name),
        })
    }

    /// Says where two columns are stored, or meant, differently.
    fn kinds_apart(&mut self, ours: &TableColumn, theirs: &TableColumn) {
        if ours.stored != theirs.stored {
            let [a, b] = [ours, theirs].map(|column| shown(&column.stored));
            self.say("type", ours, format!("{a} in A, {b} in B"));
        }
        if let (Some(a), Some(b)) = (&ours.semantic, &theirs.semantic)
            && a != b
        {
            self.say("semantic", ours, format!("{a} in A, {b} in B"));
        }
    }

    fn say(&mut self, what: &str, column: &TableColumn, says: impl Into<String>) {
        let finding = Discrepancy::new(what, &column.name, says);
        self.findings.push(finding);
    }

    /// What makes B's values A's: factor and summand. None where they are of different quantities.
    fn conversion(
        &mut self,
        (column, ours): (&TableColumn, Option<Unit>),
        (other, theirs): (&TableColumn, Option<Unit>),
    ) -> Option<(f64, f64)> {
        match (ours, theirs) {
            (Some(ours), Some(theirs)) if ours != theirs => {
                let same = ours.quantity() == theirs.quantity();
                let how = match same {
                    true => format!("; values compared in {ours}"),
                    false => ": not the same quantity".into(),
                };
                self.say("unit", column, format!("{ours} in A, {theirs} in B{how}"));
                if !same {
                    return None;
                }
                let zero = ours.from_si(theirs.to_si(0.0));
                Some((ours.from_si(theirs.to_si(1.0)) - zero, zero))
            }
            _ => {
                if column.name != other.name {
                    self.say("column", column, format!("called {} in B", other.name));
                }
                Some((1.0, 0.0))
            }
        }
    }
}

/// Rounding of a value that was stored in another unit: some units in the last place.
const CONVERTED: f64 = 4.0 * f64::EPSILON;

fn shown(stored: &str) -> &str {
    if stored.is_empty() {
        "nested or binary"
    } else {
        stored
    }
}

/// Names in the options must be columns, unless the options are for other tables, too.
fn known_names(a: &TableFile, b: &TableFile, options: &DiffOptions) -> Result<()> {
    if options.where_present {
        return Ok(());
    }
    let columns = [a.names(), b.names()].concat();
    let named = |flag: &'static str, names: &mut dyn Iterator<Item = &String>| -> Result<()> {
        for name in names {
            if !columns.contains(&name.as_str()) {
                let hint = did_you_mean(name, columns.iter().copied());
                let message = format!("no column `{name}` in either{hint}");
                return Err(Error::spec(flag, message));
            }
        }
        Ok(())
    };
    named("--ignore", &mut options.ignore.iter())?;
    named("--atol", &mut options.atol.columns.keys())?;
    named("--rtol", &mut options.rtol.columns.keys())?;
    named("--quaternion", &mut options.quaternions.iter().flatten())
}

/// Columns that are one rotation together: declared, asked for, or by their names; true for a rotation vector.
fn groups(a: &TableFile, options: &DiffOptions) -> Vec<(Vec<String>, bool)> {
    let mut groups: Vec<(Vec<String>, bool)> = options
        .quaternions
        .iter()
        .map(|names| (names.clone(), false))
        .collect();
    let declared = |semantic: &str, size: usize, groups: &mut Vec<(Vec<String>, bool)>| {
        let named = a
            .columns
            .iter()
            .filter(|column| column.semantic.as_deref() == Some(semantic));
        let names: Vec<String> = named.map(|column| column.name.clone()).collect();
        groups.extend(
            names
                .chunks_exact(size)
                .map(|names| (names.to_vec(), size == 3)),
        );
    };
    declared("quaternion", 4, &mut groups);
    declared("rotation_vector", 3, &mut groups);
    for column in &a.columns {
        let Some(at) = column.name.find("qw") else {
            continue;
        };
        let with = |axis: &str| format!("{}q{axis}{}", &column.name[..at], &column.name[at + 2..]);
        let names: Vec<String> = ["w", "x", "y", "z"].map(with).to_vec();
        if names.iter().all(|name| a.position(name).is_some())
            && !groups.iter().any(|(known, _)| known.contains(&names[0]))
        {
            groups.push((names, false));
        }
    }
    groups
}

/// The unit of a column: as the file says, or as the end of its name does.
fn unit(source: &TableFile, column: usize) -> Option<Unit> {
    let column = &source.columns[column];
    if !matches!(column.kind, CellKind::Float | CellKind::Int) {
        return None;
    }
    match &column.unit {
        Some(symbol) => Unit::parse(symbol),
        None => Unit::parse(split(&column.name)?.1),
    }
}

/// A name before its unit, and the unit.
fn split(name: &str) -> Option<(&str, &str)> {
    name.rsplit_once('_').filter(|(stem, end)| {
        !stem.is_empty() && Unit::parse(end).is_some_and(|unit| unit != Unit::One)
    })
}

/// The column of B of the same name, or of the same name but for the unit at its end.
fn counterpart(a: &TableFile, b: &TableFile, at_a: usize, used: &BTreeSet<usize>) -> Option<usize> {
    let name = &a.columns[at_a].name;
    if let Some(same) = b.position(name) {
        return Some(same);
    }
    let (stem, _) = split(name)?;
    let quantity = unit(a, at_a)?.quantity();
    (0..b.columns.len()).find(|&at| {
        let other = &b.columns[at].name;
        let same_stem = split(other).is_some_and(|(other, _)| other == stem);
        same_stem
            && !used.contains(&at)
            && a.position(other).is_none()
            && unit(b, at).is_some_and(|unit| unit.quantity() == quantity)
    })
}

fn angle_unit(source: &TableFile, column: usize) -> Option<Unit> {
    unit(source, column).filter(|unit| unit.quantity() == Quantity::Angle)
}

/// A full turn in the column's unit, where values compare modulo a turn: as a known schema says; in a foreign file, all angles.
fn turn(source: &TableFile, column: usize) -> Option<f64> {
    let unit = angle_unit(source, column)?;
    let known = source
        .schema()
        .is_some_and(|schema| schema.field_of(&source.columns[column].name).is_some());
    let declared = source.columns[column].semantic.as_deref() == Some("angle");
    (declared || !known).then(|| unit.from_si(std::f64::consts::TAU))
}

fn tolerance(a: &TableFile, name: &str, options: &DiffOptions, unit: Unit) -> (f64, f64) {
    let field = a
        .schema()
        .and_then(|schema| schema.field_of(name))
        .map(|(field, _)| &field.diff);
    let of_wish = |wish: &Tolerances, schema: Option<f64>| {
        wish.of(name, unit).unwrap_or(schema.unwrap_or(0.0))
    };
    (
        of_wish(&options.atol, field.map(|field| field.atol)),
        of_wish(&options.rtol, field.map(|field| field.rtol)),
    )
}

/// The column with one standard deviation of `name`: as the schema says, or by its name.
fn sigma(a: &TableFile, b: &TableFile, name: &str) -> Option<(usize, usize)> {
    let named = a
        .schema()
        .and_then(|schema| schema.field_of(name))
        .and_then(|(field, _)| field.diff.sigma.clone());
    let (stem, end) = split(name).map_or((name, String::new()), |(stem, end)| {
        (stem, format!("_{end}"))
    });
    let by_name = ["_std", "_sigma"]
        .into_iter()
        .flat_map(|word| [format!("{name}{word}"), format!("{stem}{word}{end}")]);
    let candidates = named
        .into_iter()
        .chain(by_name)
        .chain([format!("sigma_{name}")]);
    candidates.into_iter().find_map(|candidate| {
        let (at_a, at_b) = (a.position(&candidate)?, b.position(&candidate)?);
        let numbers =
            a.columns[at_a].kind == CellKind::Float && b.columns[at_b].kind == CellKind::Float;
        (numbers && candidate != name).then_some((at_a, at_b))
    })
}
