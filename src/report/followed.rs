//! The table of causes of torques and drives: places down the chain, what the cause follows across, as that of points has them.

use serde_json::{Value, json};

/// What torques and angles follow, as columns of the table.
const COLUMNS: [&str; 10] = [
    "own speed",
    "load",
    "own angle",
    "other angle",
    "acceleration",
    "error of the drive",
    "command",
    "time",
    "temperature",
    "constant",
];
const OTHER: &str = "other";
/// Shares of the largest finding from which a cell has the next colour.
const SHADES: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 0.6, 0.9];

/// A finding as the table shows it.
pub(super) struct FollowedFinding<'a> {
    pub(super) effect: &'a str,
    pub(super) place: &'a str,
    /// The kind of variable that it follows.
    pub(super) follows: &'a str,
    /// In the unit of the table.
    pub(super) size: f64,
}

impl FollowedFinding<'_> {
    fn column(&self) -> &'static str {
        let mut known = COLUMNS.into_iter();
        known
            .find(|column| *column == self.follows)
            .unwrap_or(OTHER)
    }
}

/// The table: size and names in each cell.
pub(super) fn grid(findings: &[FollowedFinding]) -> Value {
    let columns: Vec<&str> = COLUMNS
        .into_iter()
        .chain([OTHER])
        .filter(|column| findings.iter().any(|finding| finding.column() == *column))
        .collect();
    let mut places: Vec<&str> = findings.iter().map(|finding| finding.place).collect();
    places.sort_by_key(|place| place_order(place));
    places.dedup();
    let sizes = findings.iter().map(|finding| finding.size);
    let largest = sizes.fold(f64::MIN_POSITIVE, f64::max);
    let cell = |place: &str, column: &str| {
        let here: Vec<&FollowedFinding> = findings
            .iter()
            .filter(|finding| finding.place == place && finding.column() == column)
            .collect();
        let size = here.iter().map(|finding| finding.size).reduce(f64::max)?;
        let names: Vec<&str> = here.iter().map(|finding| finding.effect).collect();
        let shade = SHADES
            .iter()
            .filter(|edge| size / largest >= **edge)
            .count();
        Some(json!({ "size": size, "names": names, "shade": shade, "open": names == ["unknown"] }))
    };
    let row = |place: &&str| {
        let cells: Vec<_> = columns.iter().map(|column| cell(place, column)).collect();
        json!({ "place": place, "cells": cells })
    };
    json!({ "columns": columns, "rows": places.iter().map(row).collect::<Vec<_>>() })
}

/// Down the chain; what is no joint or link stands below.
fn place_order(place: &str) -> (i64, String) {
    let number = place.split([' ', '-']).find_map(|word| word.parse().ok());
    (number.unwrap_or(i64::MAX), place.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use calib_drives::CAUSES;

    #[test]
    fn every_cause_of_drives_stands_in_a_column() {
        let others: Vec<&str> = CAUSES
            .iter()
            .filter(|cause| cause.name != "unknown" && !COLUMNS.contains(&cause.follows))
            .map(|cause| cause.name.as_ref())
            .collect();
        assert_eq!(others, Vec::<&str>::new());
    }

    #[test]
    fn places_go_down_the_chain_and_a_cell_has_all_its_names() {
        let finding = |effect, place, follows, size| FollowedFinding {
            effect,
            place,
            follows,
            size,
        };
        let grid = grid(&[
            finding("coulomb_friction", "joint 10", "own speed", 2.0),
            finding("viscous_friction", "joint 10", "own speed", 1.0),
            finding("unknown", "joint 2", "own angle", 0.1),
        ]);
        assert_eq!(grid["columns"], json!(["own speed", "own angle"]));
        assert_eq!(grid["rows"][0]["place"], "joint 2");
        assert_eq!(grid["rows"][0]["cells"][1]["open"], true);
        let cell = &grid["rows"][1]["cells"][0];
        assert_eq!((&cell["size"], &cell["shade"]), (&json!(2.0), &json!(6)));
        assert_eq!(
            cell["names"],
            json!(["coulomb_friction", "viscous_friction"])
        );
    }
}
