//! The table of causes of torques and drives: places down the chain, what the cause follows across, as that of points has them.
//!
//! Their tables of findings have no column of what a cause follows, since a cause of them is one law at a place: its name says it.

use serde_json::{Value, json};

/// What torques and angles follow, as columns of the table, each with the causes that do.
const FOLLOWED: [(&str, &[&str]); 8] = [
    (
        "own speed",
        &[
            "viscous_friction",
            "coulomb_friction",
            "asymmetric_friction",
            "stribeck_friction",
            "presliding_friction",
            "backlash_spikes",
            "wrist_coupling",
            "drive_damping",
        ],
    ),
    (
        "load",
        &[
            "load_friction",
            "torque_constant",
            "torque_limit",
            "voltage_sag",
            "backlash",
            "joint_coupling",
        ],
    ),
    (
        "own angle",
        &[
            "torque_ripple",
            "spring_balance",
            "cable_stiffness",
            "link_mass",
            "link_com",
            "payload_error",
            "gravity_direction",
        ],
    ),
    (
        "acceleration",
        &["rotor_inertia", "link_inertia", "joint_elasticity"],
    ),
    (
        "error of the drive",
        &["drive_gain", "integral_action", "dead_band"],
    ),
    ("command", &["command_delay", "command_hold", "speed_limit"]),
    ("time", &["warmup_friction", "contact", "current_latency"]),
    ("constant", &["current_offset", "command_offset"]),
];
/// What a cause without a name follows is the end of its statement.
const DEPENDS: [(&str, &str); 3] = [
    ("the angle of the joint", "own angle"),
    ("the velocity of the joint", "own speed"),
    ("the load of the joint", "load"),
];
const OTHER: &str = "other";
/// Shares of the largest finding from which a cell has the next colour.
const SHADES: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 0.6, 0.9];

/// A finding as the table shows it.
pub(super) struct FollowedFinding<'a> {
    effect: &'a str,
    place: &'a str,
    statement: &'a str,
    size: f64,
}

impl<'a> FollowedFinding<'a> {
    /// A finding of a size in the unit of the table.
    pub(super) fn new((effect, place, statement): (&'a str, &'a str, &'a str), size: f64) -> Self {
        Self {
            effect,
            place,
            statement,
            size,
        }
    }

    fn column(&self) -> &'static str {
        let of_name = |(_, names): &&(&str, &[&str])| names.contains(&self.effect);
        let statement = self.statement.trim_end_matches('.');
        let depends = DEPENDS.iter().find(|(end, _)| statement.ends_with(end));
        let named = FOLLOWED.iter().find(of_name).map(|(column, _)| *column);
        named
            .or(depends.map(|(_, column)| *column))
            .unwrap_or(OTHER)
    }
}

/// The table: size and names in each cell.
pub(super) fn grid(findings: &[FollowedFinding]) -> Value {
    let columns = FOLLOWED.iter().map(|(column, _)| *column).chain([OTHER]);
    let columns: Vec<&str> = columns
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
        let finding = |effect| FollowedFinding {
            effect,
            place: "joint 1",
            statement: "",
            size: 1.0,
        };
        let others: Vec<&str> = CAUSES
            .iter()
            .map(|cause| cause.name)
            .filter(|name| *name != "unknown" && finding(name).column() == OTHER)
            .collect();
        assert_eq!(others, Vec::<&str>::new());
    }

    #[test]
    fn places_go_down_the_chain_and_a_cell_has_all_its_names() {
        let finding = |effect, place, size| FollowedFinding {
            effect,
            place,
            statement: "something acts; it depends on the angle of the joint",
            size,
        };
        let grid = grid(&[
            finding("coulomb_friction", "joint 10", 2.0),
            finding("viscous_friction", "joint 10", 1.0),
            finding("unknown", "joint 2", 0.1),
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
