//! Files are read once, whatever becomes of their rows.

use super::{HEAD, TWO, Taken, good, robot, rr, take};
use crate::answer::starts_with;
use crate::desk::Desk;

const JOINED: &str = r#"
files:
  - file: arm.csv
    columns:
      point_id: {column: k}
      q: {column: "q{j}", unit: rad}
  - file: tracker.csv
    columns:
      point_id: {column: k}
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
join: {by: id}
"#;

/// What a measurement gives, and how often each file was opened.
fn read(arm: &str, tracker: &str, yaml: &str) -> (Taken, [usize; 2]) {
    let desk = Desk::default()
        .with("arm.csv", format!("k,q1\n{arm}"))
        .with("tracker.csv", format!("k,x,y,z\n{tracker}"));
    let taken = take(&desk, yaml, robot("r", 2.0)).unwrap();
    let opened = desk.opened.lock().unwrap().clone();
    (
        taken,
        ["arm.csv", "tracker.csv"].map(|name| opened.iter().filter(|file| *file == name).count()),
    )
}

fn refused(taken: &Taken) -> Vec<(&str, i64, &str)> {
    taken
        .rejected
        .0
        .iter()
        .map(|row| (row.file.as_str(), row.line, row.reason.as_str()))
        .collect()
}

#[test]
fn text_behind_a_closing_quote_refuses_its_row() {
    let (taken, _) = read(
        "A,1\nB,\"0.25\"0\nC,\"0.25\"\n\"D\"x,3\n",
        "A,1,1,1\nC,3,3,3\n",
        JOINED,
    );
    assert_eq!(taken.recording.point_id, ["A", "C"]);
    assert_eq!(
        refused(&taken),
        [("arm.csv", 3, "damaged"), ("arm.csv", 5, "damaged")]
    );
    let detail = &taken.rejected.0[0].detail;
    starts_with(
        detail,
        "column 2: text behind the closing `\"` of a field; allowed:",
    );
    let desk = Desk::default().with("a.csv", format!("\"id\"x,q1,q2,x,y,z\n{}", good(3)));
    let header = take(&desk, TWO, rr()).err().unwrap().to_string();
    starts_with(&header, "a.csv:1: column 1: text behind");
}

#[test]
fn rows_that_are_used_as_they_come_are_read_once() {
    let (taken, opened) = read(
        "A,1\nB,2\nC,bad\nD,3\n",
        "D,4,4,4\nB,2,2,2\nA,1,1,1\n",
        JOINED,
    );
    assert_eq!(opened, [1, 1]);
    assert_eq!(taken.recording.point_id, ["A", "B", "D"]);
    assert_eq!(taken.recording.sequence, [1, 2, 4]);
    assert_eq!(refused(&taken), [("arm.csv", 4, "not_a_number")]);
    let columns = "  - file: tracker.csv\n    columns:\n";
    let ordered = JOINED.replace("by: id", "by: order").replace(
        &format!("{columns}      point_id: {{column: k}}\n"),
        columns,
    );
    let (taken, opened) = read("A,1\nB,2\nC,3\n", "a,1,1,1\nb,,2,2\nc,3,3,3\n", &ordered);
    assert_eq!(opened, [1, 1]);
    assert_eq!(
        refused(&taken),
        [("arm.csv", 3, "unmatched"), ("tracker.csv", 3, "blank")]
    );
    let desk = Desk::default().with("a.csv", format!("{HEAD}{}", good(3)));
    assert_eq!(take(&desk, TWO, rr()).unwrap().recording.rows(), 3);
    assert_eq!(*desk.opened.lock().unwrap(), ["a.csv"]);
}

#[test]
fn rows_that_turn_out_to_have_no_partner_are_not_read_again() {
    let (taken, opened) = read("A,1\nB,2\n", "A,1,1,1\nX,2,2,2\nB,3,3,3\n", JOINED);
    assert_eq!(opened, [1, 1]);
    assert_eq!(taken.recording.point_id, ["A", "B"]);
    assert_eq!(refused(&taken), [("tracker.csv", 3, "unmatched")]);
    assert_eq!(taken.rejected.0[0].text, "X,2,2,2");
}

#[test]
fn an_id_that_stands_twice_is_known_before_anything_is_written() {
    let yaml = format!("{JOINED}max_rejected_fraction: 0.9\n");
    let (taken, opened) = read("A,1\nB,2\nA,3\n", "A,1,1,1\nB,3,3,3\n", &yaml);
    assert_eq!(opened, [1, 1]);
    assert_eq!(taken.recording.point_id, ["B"]);
    let places = [
        ("arm.csv", 2, "duplicate_id"),
        ("arm.csv", 4, "duplicate_id"),
        ("tracker.csv", 2, "unmatched"),
    ];
    assert_eq!(refused(&taken), places);
}
