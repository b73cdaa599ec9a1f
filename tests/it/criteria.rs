//! Numbers by which something is decided stand in one room, each with its meaning, unit and source.

use calib::criteria::TABLES;
use std::collections::BTreeSet;

use crate::source::files;

/// Kinds of sources.
const KINDS: [&str; 5] = [
    "literature: ",
    "physics: ",
    "count: ",
    "measured by tests/reference/",
    "judgement: ",
];

/// Rooms whose deciding numbers are in the tables.
const ROOMS: [&str; 3] = [
    "numerics/diagnose/",
    "numerics/estimate/choose/",
    "numerics/estimate/screen/",
];

/// Numbers of those rooms that decide nothing: how work is dealt out, steps and bounds of solvers and of grids, roundings, units.
const MECHANICS: [&str; 42] = [
    "AMPLITUDES",
    "ANGLE",
    "ANY",
    "AR1_COEFFICIENTS",
    "ARCSEC",
    "ARROWS",
    "BATCH",
    "BLOCK",
    "CHUNK",
    "COLUMNS",
    "FARTHEST",
    "FEW",
    "FINE",
    "FITTED",
    "FOLDS",
    "FORMS",
    "FREEDOMS",
    "HIGHEST",
    "INVISIBLE",
    "LARGEST",
    "LIMIT",
    "LISTED",
    "LOWEST",
    "MIN_SEPARATION_L",
    "NEVER",
    "NOTHING",
    "OUTSIDE",
    "PLACE",
    "RIDGE",
    "ROWS",
    "SETTLED",
    "SHARES",
    "SHORT",
    "SLIPS",
    "SMALLEST",
    "STEP",
    "STEPS",
    "THERE",
    "TRAIL",
    "TURN",
    "TYPICAL",
    "UNIT",
];

#[test]
fn every_criterion_has_a_meaning_a_unit_and_a_source() {
    let mut names = BTreeSet::new();
    for row in TABLES.iter().copied().flatten() {
        let called = format!("{}::{}", row.room, row.name);
        assert!(
            !row.meaning.trim().is_empty() && !row.unit.is_empty(),
            "{called}"
        );
        assert!(
            KINDS.iter().any(|kind| row.source.starts_with(kind)),
            "{called}: source `{}`",
            row.source
        );
        assert!(names.insert(called.clone()), "{called} twice");
    }
    assert!(names.len() > 150);
}

#[test]
fn no_number_decides_outside_the_tables() {
    let mut faults = Vec::new();
    let src = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in files(&src) {
        let file = path.strip_prefix(&src).unwrap().display().to_string();
        if !ROOMS.iter().any(|room| file.starts_with(room)) {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for (at, line) in text.lines().enumerate() {
            let Some((_, tail)) = line.split_once("const ") else {
                continue;
            };
            let Some((name, kind)) = tail.split_once(": ") else {
                continue;
            };
            let number = ["f64", "usize", "u64", "u32", "i64", "i32", "[f64", "[usize"]
                .iter()
                .any(|ours| kind.starts_with(ours));
            if number && !MECHANICS.contains(&name) && name != "UNSEEN" {
                faults.push(format!("{file}:{}: {name}", at + 1));
            }
        }
    }
    assert!(
        faults.is_empty(),
        "state meaning, unit and source in src/numerics/criteria:\n{}",
        faults.join("\n")
    );
}
