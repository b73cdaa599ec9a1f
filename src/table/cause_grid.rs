//! The table of causes as a person looks at it: places down the chain, kinds of variable across; findings and residual.

use super::{Cells, Findings};
use crate::effect::{Place, names};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Kinds of variable, as columns.
const COLUMNS: [&str; 12] = [
    "own angle",
    "other angle",
    "load",
    "payload",
    "approach",
    "travel",
    "speed",
    "time",
    "temperature",
    "position",
    "circumstance",
    "constant",
];

/// A row for every place, and two cells, before and after, for every column.
#[derive(Debug, Serialize)]
pub struct CauseGrid {
    /// Kinds of variable with a finding or a residual; all that were compared where there is none.
    pub columns: Vec<&'static str>,
    /// Kinds of variable that were compared, with nothing in any cell.
    pub others: Vec<&'static str>,
    /// Down the chain, from the base to the instrument.
    pub rows: Vec<CauseGridRow>,
}

/// A place.
#[derive(Debug, Serialize)]
pub struct CauseGridRow {
    /// E.g. `joint 3`.
    pub place: String,
    /// Findings; null where no cell was compared.
    pub found: Vec<Option<CauseGridCell>>,
    /// Rms that the likeliest further cause would explain.
    pub left: Vec<Option<CauseGridCell>>,
}

/// A place and a kind of variable.
#[derive(Debug, Clone, Default, Serialize)]
pub struct CauseGridCell {
    /// Rms motion at the tool; none where nothing is there, or no length was measured.
    pub mm: Option<f64>,
    /// Effects, by their names.
    pub effects: Vec<String>,
    /// Whether one of them has a name.
    pub is_named: bool,
}

impl CauseGrid {
    /// Of one diagnosis.
    pub fn of(cells: &Cells, findings: &Findings) -> Self {
        let mut found: BTreeMap<(String, String), CauseGridCell> = BTreeMap::new();
        for finding in &findings.0 {
            let Some(follows) = &finding.follows else {
                continue;
            };
            let cell = found
                .entry((row_of(&finding.place), follows.clone()))
                .or_default();
            cell.mm = [cell.mm, finding.effect_rms_mm]
                .into_iter()
                .flatten()
                .reduce(f64::max);
            cell.is_named |= finding.effect != names::UNKNOWN;
            if !cell.effects.contains(&finding.effect) {
                cell.effects.push(finding.effect.clone());
            }
        }
        let mut left: BTreeMap<(String, String), CauseGridCell> = BTreeMap::new();
        for row in cells.0.iter().filter(|row| row.moment == "after") {
            let cell = left
                .entry((row_of(&row.place), row.follows.clone()))
                .or_default();
            if row.delta_bic > 0.0
                && cell
                    .mm
                    .is_none_or(|mm| row.explains_mm.is_some_and(|other| other > mm))
            {
                let is_named = row.effect != names::UNKNOWN;
                *cell = CauseGridCell {
                    mm: row.explains_mm,
                    effects: vec![row.effect.clone()],
                    is_named,
                };
            }
        }
        let asked: BTreeSet<&(String, String)> = left.keys().chain(found.keys()).collect();
        let asked_of = |column: &str| asked.iter().any(|(_, follows)| follows == column);
        let something = |column: &str| {
            let is_there = |((_, follows), cell): (&(String, String), &CauseGridCell)| {
                follows == column && !cell.effects.is_empty()
            };
            found.iter().any(is_there) || left.iter().any(is_there)
        };
        let (mut columns, mut others): (Vec<_>, Vec<_>) = COLUMNS
            .into_iter()
            .filter(|column| asked_of(column))
            .partition(|column| something(column));
        if columns.is_empty() {
            std::mem::swap(&mut columns, &mut others);
        }
        let is_one = |place: Place| {
            !matches!(place, Place::Links(first, last) if first != last) && along(place).is_some()
        };
        let shown = |place: &str| {
            found.keys().any(|(at, _)| at == place) || place.parse().is_ok_and(is_one)
        };
        let mut places: Vec<&str> = asked
            .iter()
            .map(|(place, _)| place.as_str())
            .filter(|place| shown(place))
            .collect();
        places.dedup();
        places.sort_by_key(|place| place.parse().ok().and_then(along).unwrap_or(usize::MAX));
        let rows = places.into_iter().map(|place| {
            let of_all = |all: &BTreeMap<(String, String), CauseGridCell>, column: &str| {
                let key = (place.to_string(), column.to_string());
                asked
                    .contains(&key)
                    .then(|| all.get(&key).cloned().unwrap_or_default())
            };
            CauseGridRow {
                place: place.into(),
                found: columns
                    .iter()
                    .map(|column| of_all(&found, column))
                    .collect(),
                left: columns.iter().map(|column| of_all(&left, column)).collect(),
            }
        });
        Self {
            rows: rows.collect(),
            columns,
            others,
        }
    }
}

impl CauseGrid {
    /// The findings in columns of text; empty without any.
    pub fn text(&self) -> String {
        let size = |cell: &Option<CauseGridCell>| match cell.as_ref().and_then(|cell| cell.mm) {
            Some(mm) if mm >= 1.0 => format!("{mm:.2} mm"),
            Some(mm) => format!("{:.0} um", 1e3 * mm),
            None => String::new(),
        };
        let has = |column: &usize| {
            self.rows.iter().any(|row| {
                row.found[*column]
                    .as_ref()
                    .is_some_and(|cell| cell.mm.is_some())
            })
        };
        let columns: Vec<usize> = (0..self.columns.len()).filter(has).collect();
        if columns.is_empty() {
            return String::new();
        }
        let line = |head: &str, cells: &[String]| {
            let cells: String = cells.iter().map(|cell| format!("{cell:>12}")).collect();
            format!("{head:10}{cells}").trim_end().to_string() + "\n"
        };
        let names: Vec<String> = columns
            .iter()
            .map(|column| self.columns[*column].to_string())
            .collect();
        let rows = self.rows.iter().map(|row| {
            (
                row,
                columns
                    .iter()
                    .map(|column| size(&row.found[*column]))
                    .collect::<Vec<_>>(),
            )
        });
        let rows = rows.filter(|(_, cells)| cells.iter().any(|cell| !cell.is_empty()));
        line("found", &names)
            + &rows
                .map(|(row, cells)| line(&row.place, &cells))
                .collect::<String>()
    }
}

/// The row that has a place: what moves a joint with another one is that joint's.
fn row_of(place: &str) -> String {
    match place.parse() {
        Ok(Place::Coupled(_, moved)) => Place::Joint(moved).to_string(),
        _ => place.into(),
    }
}

/// Where a place is along the chain; none of what is no place of arm or instrument.
fn along(place: Place) -> Option<usize> {
    match place {
        Place::Base => Some(0),
        Place::Joint(joint) => Some(3 * joint + 1),
        Place::Links(first, last) => Some(3 * first + if first == last { 2 } else { 3 }),
        Place::Tool => Some(usize::MAX - 2),
        Place::Tracker => Some(usize::MAX - 1),
        _ => None,
    }
}
