//! Recordings that are no delimited text.

use super::layouts::{joints, made, point, table};
use crate::workbook::workbook;

/// A table of thirty rows, for a sheet.
fn sheet(header: &str, row: impl Fn(usize) -> String) -> String {
    table(header, |k| format!("P{k}|{}", row(k)))
}

#[test]
fn joints_and_points_in_two_sheets_of_a_workbook_are_joined() {
    let controller = sheet("Cell 7\n\nName|A1|A2|A3|A4|A5|A6", |k| joints(k, "|"));
    let tracker = sheet("Name|X|Y|Z\n|mm|mm|mm", |k| point(k, "|"));
    let book = workbook(&[
        ("About", "made by hand"),
        ("Robot", &controller),
        ("Tracker", &tracker),
    ]);
    let found = made(&[("cell 7.xlsx", book)]);
    found.has(&[
        "sheet: \"Robot\"",
        "skip: 2",
        "q: {column: \"A{j}\", unit: deg}",
        "point_id: {column: \"Name\"}",
    ]);
    found.has(&[
        "sheet: \"Tracker\"",
        "skip_below_header: 1",
        "x: {column: \"X\", unit: mm}",
        "join: {by: id}",
    ]);
    found.lacks(&["delimiter", "decimal"]).runs(30);
}

#[test]
fn the_only_sheet_with_numbers_is_read_and_among_many_one_is_asked_for() {
    let whole = sheet("Name|A1|A2|A3|A4|A5|A6|X|Y|Z", |k| {
        format!("{}|{}", joints(k, "|"), point(k, "|"))
    });
    let found = made(&[(
        "one.xlsx",
        workbook(&[("About", "made by hand"), ("Data", &whole)]),
    )]);
    found
        .has(&[
            "sheet: \"Data\"",
            "q: {column: \"A{j}\", unit: deg}",
            "x: {column: \"X\", unit: mm}",
        ])
        .runs(30);
    let found = made(&[(
        "three.xlsx",
        workbook(&[("A", &whole), ("B", &whole), ("C", &whole)]),
    )]);
    assert!(
        found
            .printed
            .contains("has numbers in several sheets; say which, `sheet: NAME`"),
        "{}",
        found.printed
    );
    found.says(&["# REPLACE"]);
}

#[test]
fn joints_that_a_program_declares_join_the_points_of_a_tracker() {
    let target = |k: usize| {
        format!(
            "  CONST jointtarget P{k}:=[[{}],[9E9,9E9,9E9,9E9,9E9,9E9]];\n",
            joints(k, ",")
        )
    };
    let module = format!(
        "MODULE Measure\n{}ENDMODULE\n",
        (0..30).map(target).collect::<String>()
    );
    let points = table("Name,X [mm],Y [mm],Z [mm]", |k| {
        format!("P{k},{}", point(k, ","))
    });
    let found = made(&[
        ("measure.mod", module.into_bytes()),
        ("tracker.csv", points.into_bytes()),
    ]);
    found.has(&[
        "point_id: {column: \"name\"}",
        "q: {column: \"rax_{j}\", unit: deg}\n".trim_end(),
        "join: {by: id}",
    ]);
    found.runs(30);
}
