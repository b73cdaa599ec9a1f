//! How often files are read, and that the tables do not depend on it.

use super::{HEAD, TWO, Taken, good, robot, take};
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
    let desk = Desk::default().with("arm.csv", format!("k,q1\n{arm}")).with("tracker.csv", format!("k,x,y,z\n{tracker}"));
    let taken = take(&desk, yaml, robot("r", 2.0)).unwrap();
    let opened = desk.opened.lock().unwrap().clone();
    (taken, ["arm.csv", "tracker.csv"].map(|name| opened.iter().filter(|file| *file == name).count()))
}

fn refused(taken: &Taken) -> Vec<(&str, i64, &str)> {
    taken.rejected.0.iter().map(|row| (row.file.as_str(), row.line, row.reason.as_str())).collect()
}

#[test]
fn rows_that_are_used_as_they_come_are_read_once() {
    let (taken, opened) = read("A,1\nB,2\nC,bad\nD,3\n", "D,4,4,4\nB,2,2,2\nA,1,1,1\n", JOINED);
    assert_eq!(opened, [1, 1]);
    assert_eq!(taken.recording.point_id, ["A", "B", "D"]);
    assert_eq!(taken.recording.sequence, [1, 2, 4]);
    assert_eq!(refused(&taken), [("arm.csv", 4, "not_a_number")]);
    let ordered = JOINED.replace("by: id", "by: order");
    let (taken, opened) = read("A,1\nB,2\nC,3\n", "a,1,1,1\nb,,2,2\nc,3,3,3\n", &ordered);
    assert_eq!(opened, [1, 1]);
    assert_eq!(refused(&taken), [("arm.csv", 3, "unmatched"), ("tracker.csv", 3, "blank")]);
    let desk = Desk::default().with("a.csv", format!("{HEAD}{}", good(3)));
    assert_eq!(take(&desk, TWO, robot("rr", 1.0)).unwrap().recording.rows(), 3);
    assert_eq!(*desk.opened.lock().unwrap(), ["a.csv"]);
}

#[test]
fn a_file_is_read_again_where_rows_of_it_turn_out_to_have_no_partner() {
    let (taken, opened) = read("A,1\nB,2\n", "A,1,1,1\nX,2,2,2\nB,3,3,3\n", JOINED);
    assert_eq!(opened, [1, 2]);
    assert_eq!(taken.recording.point_id, ["A", "B"]);
    assert_eq!(refused(&taken), [("tracker.csv", 3, "unmatched")]);
    assert_eq!(taken.rejected.0[0].text, "X,2,2,2");
}

#[test]
fn an_id_that_stands_twice_takes_back_what_was_written() {
    let (taken, opened) = read("A,1\nB,2\nA,3\n", "A,1,1,1\nB,3,3,3\n", JOINED);
    assert_eq!(opened, [2, 2]);
    assert_eq!(taken.recording.point_id, ["B"]);
    let places = [("arm.csv", 2, "duplicate_id"), ("arm.csv", 4, "duplicate_id"), ("tracker.csv", 2, "unmatched")];
    assert_eq!(refused(&taken), places);
}
