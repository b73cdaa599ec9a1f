//! Which column of A is compared with which of B, how, and with what tolerance: from the schema, the files and the options.

use std::collections::BTreeSet;

use super::source::{Kind, Source};
use super::{Finding, Options, Tolerances};
use crate::error::{Error, Result, nearest};
use crate::units::{Quantity, Unit};

/// Columns of A and of B that hold the same.
#[derive(Debug, Clone)]
pub(super) struct Comparison {
    /// As A calls it.
    pub name: String,
    pub a: Vec<usize>,
    pub b: Vec<usize>,
    pub how: How,
    /// Of the difference; empty where there is none, `row` where every row has its own.
    pub unit: String,
    /// B's values are multiplied by the first and added to the second, so that they are in A's unit.
    pub conversion: (f64, f64),
    pub atol: f64,
    pub rtol: f64,
    /// Columns with one standard deviation of the values, in A and in B.
    pub sigma: Option<(usize, usize)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum How {
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
    a: &Source,
    b: &Source,
    key: &[String],
    options: &Options,
    findings: &mut Vec<Finding>,
) -> Result<Vec<Comparison>> {
    known_names(a, b, options)?;
    let ignored = |name: &String| key.contains(name) || options.ignore.contains(name);
    let mut used_b: BTreeSet<usize> = BTreeSet::new();
    let mut used_a: BTreeSet<usize> = BTreeSet::new();
    let mut comparisons = Vec::new();
    for (names, vector) in groups(a, options) {
        let at = |source: &Source| names.iter().map(|name| source.position(name)).collect::<Option<Vec<usize>>>();
        let (Some(at_a), Some(at_b)) = (at(a), at(b)) else { continue };
        if names.iter().any(ignored) {
            continue;
        }
        used_a.extend(&at_a);
        used_b.extend(&at_b);
        let factor = angle_unit(a, at_a[0]).map_or(1.0, |unit| unit.to_si(1.0));
        let how = if vector { How::RotationVector(factor) } else { How::Quaternion };
        let (atol, rtol) = tolerance(a, &names[0], options, Unit::Radian);
        comparisons.push(Comparison {
            name: names.join(","),
            a: at_a,
            b: at_b,
            how,
            unit: "rad".into(),
            conversion: (1.0, 0.0),
            atol,
            rtol,
            sigma: None,
        });
    }
    for (at_a, column) in a.columns.iter().enumerate() {
        if used_a.contains(&at_a) || ignored(&column.name) {
            continue;
        }
        let Some(at_b) = counterpart(a, b, at_a, &used_b) else {
            findings.push(Finding::new("column", &column.name, "only in A"));
            continue;
        };
        used_b.insert(at_b);
        let theirs = &b.columns[at_b];
        if column.stored != theirs.stored {
            findings.push(Finding::new(
                "type",
                &column.name,
                format!("{} in A, {} in B", shown(&column.stored), shown(&theirs.stored)),
            ));
        }
        if column.semantic != theirs.semantic && column.semantic.is_some() && theirs.semantic.is_some() {
            let of = |semantic: &Option<String>| semantic.clone().unwrap_or_default();
            findings.push(Finding::new(
                "semantic",
                &column.name,
                format!("{} in A, {} in B", of(&column.semantic), of(&theirs.semantic)),
            ));
        }
        let (unit_a, unit_b) = (unit(a, at_a), unit(b, at_b));
        let mut conversion = (1.0, 0.0);
        if let (Some(ours), Some(theirs_unit)) = (unit_a, unit_b)
            && ours != theirs_unit
        {
            if ours.quantity() != theirs_unit.quantity() {
                findings.push(Finding::new(
                    "unit",
                    &column.name,
                    format!("{ours} in A, {theirs_unit} in B: not the same quantity"),
                ));
                continue;
            }
            let zero = ours.from_si(theirs_unit.to_si(0.0));
            conversion = (ours.from_si(theirs_unit.to_si(1.0)) - zero, zero);
            findings.push(Finding::new(
                "unit",
                &column.name,
                format!("{ours} in A, {theirs_unit} in B; values compared in {ours}"),
            ));
        } else if column.name != theirs.name {
            findings.push(Finding::new("column", &column.name, format!("called {} in B", theirs.name)));
        }
        let text = column.kind == Kind::Text || theirs.kind == Kind::Text;
        let how = match (text, turn(a, at_a)) {
            (true, _) => How::Text,
            (false, Some(turn)) => How::Angle(turn),
            (false, None) => How::Number,
        };
        let (atol, mut rtol) = tolerance(a, &column.name, options, unit_a.unwrap_or(Unit::One));
        if conversion != (1.0, 0.0) {
            rtol = rtol.max(CONVERTED);
        }
        let symbol = column.unit.clone().or_else(|| unit_a.map(|unit| unit.symbol().to_string())).unwrap_or_default();
        comparisons.push(Comparison {
            name: column.name.clone(),
            a: vec![at_a],
            b: vec![at_b],
            how,
            unit: if symbol == "1" { String::new() } else { symbol },
            conversion,
            atol,
            rtol,
            sigma: sigma(a, b, &column.name),
        });
    }
    for (at_b, column) in b.columns.iter().enumerate() {
        if !used_b.contains(&at_b) && !ignored(&column.name) {
            findings.push(Finding::new("column", &column.name, "only in B"));
        }
    }
    comparisons.sort_by_key(|comparison| comparison.a[0]);
    Ok(comparisons)
}

/// Rounding of a value that was stored in another unit: some units in the last place.
const CONVERTED: f64 = 4.0 * f64::EPSILON;

fn shown(stored: &str) -> &str {
    if stored.is_empty() { "nested or binary" } else { stored }
}

/// Names in the options must be columns.
fn known_names(a: &Source, b: &Source, options: &Options) -> Result<()> {
    let columns: Vec<&str> = a.columns.iter().chain(&b.columns).map(|column| column.name.as_str()).collect();
    let named = |flag: &'static str, names: &mut dyn Iterator<Item = &String>| -> Result<()> {
        for name in names {
            if !columns.contains(&name.as_str()) {
                let hint = nearest(name, columns.iter().copied()).map(|near| format!("; did you mean `{near}`?"));
                let message = format!("no column `{name}` in either{}", hint.unwrap_or_default());
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
fn groups(a: &Source, options: &Options) -> Vec<(Vec<String>, bool)> {
    let mut groups: Vec<(Vec<String>, bool)> = options.quaternions.iter().map(|names| (names.clone(), false)).collect();
    let declared = |semantic: &str, size: usize, groups: &mut Vec<(Vec<String>, bool)>| {
        let named = a.columns.iter().filter(|column| column.semantic.as_deref() == Some(semantic));
        let names: Vec<String> = named.map(|column| column.name.clone()).collect();
        groups.extend(names.chunks_exact(size).map(|names| (names.to_vec(), size == 3)));
    };
    declared("quaternion", 4, &mut groups);
    declared("rotation_vector", 3, &mut groups);
    for column in &a.columns {
        let Some(at) = column.name.find("qw") else { continue };
        let with = |axis: &str| format!("{}q{axis}{}", &column.name[..at], &column.name[at + 2..]);
        let names: Vec<String> = ["w", "x", "y", "z"].map(with).to_vec();
        if names.iter().all(|name| a.position(name).is_some()) && !groups.iter().any(|(known, _)| known.contains(&names[0])) {
            groups.push((names, false));
        }
    }
    groups
}

/// The unit of a column: as the file says, or as the end of its name does.
fn unit(source: &Source, column: usize) -> Option<Unit> {
    let column = &source.columns[column];
    if !matches!(column.kind, Kind::Float | Kind::Int) {
        return None;
    }
    match &column.unit {
        Some(symbol) => Unit::parse(symbol),
        None => Unit::parse(split(&column.name)?.1),
    }
}

/// A name before its unit, and the unit.
fn split(name: &str) -> Option<(&str, &str)> {
    name.rsplit_once('_').filter(|(stem, end)| !stem.is_empty() && Unit::parse(end).is_some_and(|unit| unit != Unit::One))
}

/// The column of B of the same name, or of the same name but for the unit at its end.
fn counterpart(a: &Source, b: &Source, at_a: usize, used: &BTreeSet<usize>) -> Option<usize> {
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

fn angle_unit(source: &Source, column: usize) -> Option<Unit> {
    unit(source, column).filter(|unit| unit.quantity() == Quantity::Angle)
}

/// A full turn in the column's unit, where values compare modulo a turn: as a known schema says; in a foreign file, all angles.
fn turn(source: &Source, column: usize) -> Option<f64> {
    let unit = angle_unit(source, column)?;
    let known = source.schema().is_some_and(|schema| schema.field_of(&source.columns[column].name).is_some());
    let declared = source.columns[column].semantic.as_deref() == Some("angle");
    (declared || !known).then(|| unit.from_si(std::f64::consts::TAU))
}

fn tolerance(a: &Source, name: &str, options: &Options, unit: Unit) -> (f64, f64) {
    let field = a.schema().and_then(|schema| schema.field_of(name)).map(|(field, _)| &field.diff);
    let of = |wish: &Tolerances, schema: Option<f64>| wish.of(name, unit).unwrap_or(schema.unwrap_or(0.0));
    (of(&options.atol, field.map(|field| field.atol)), of(&options.rtol, field.map(|field| field.rtol)))
}

/// The column with one standard deviation of `name`: as the schema says, or by its name.
fn sigma(a: &Source, b: &Source, name: &str) -> Option<(usize, usize)> {
    let named = a.schema().and_then(|schema| schema.field_of(name)).and_then(|(field, _)| field.diff.sigma.clone());
    let (stem, end) = split(name).map_or((name, String::new()), |(stem, end)| (stem, format!("_{end}")));
    let by_name = ["_std", "_sigma"].into_iter().flat_map(|word| [format!("{name}{word}"), format!("{stem}{word}{end}")]);
    let candidates = named.into_iter().chain(by_name).chain([format!("sigma_{name}")]);
    candidates.into_iter().find_map(|candidate| {
        let (at_a, at_b) = (a.position(&candidate)?, b.position(&candidate)?);
        let numbers = a.columns[at_a].kind == Kind::Float && b.columns[at_b].kind == Kind::Float;
        (numbers && candidate != name).then_some((at_a, at_b))
    })
}
