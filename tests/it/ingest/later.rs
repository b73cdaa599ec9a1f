//! Measurements of several days: each joined by itself, then appended.

use super::{faults_of, refusal, rr, settings, take};
use crate::answer::{has, starts_with};
use crate::desk::Desk;
use calib::stage::Stage;

const DAYS: &str = r#"
files:
  - file: joints1.csv
    columns:
      point_id: {column: id}
      time: {column: t, unit: s}
      q: {column: "q{j}", unit: deg}
  - file: points1.csv
    columns:
      point_id: {column: id}
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
join: {by: id}
later:
  - files: [joints2.csv, points2.csv]
    gap_s: 500
"#;

fn desk() -> Desk {
    Desk::default()
        .with("joints1.csv", "id,t,q1,q2\nP1,0,10,20\nP2,30,11,21\n")
        .with("points1.csv", "id,x,y,z\nP2,4,5,6\nP1,1,2,3\n")
        .with(
            "joints2.csv",
            "id,t,q1,q2\nP1,5,12,22\nP2,35,13,23\nP3,65,14,24\n",
        )
        .with("points2.csv", "id,x,y,z\nP1,7,8,9\nP3,10,11,12\nP4,1,1,1\n")
}

#[test]
fn a_later_measurement_is_joined_by_itself_and_follows() {
    let taken = take(
        &desk(),
        &format!("{DAYS}max_rejected_fraction: 0.6\n"),
        rr(),
    )
    .unwrap();
    let recording = &taken.recording;
    assert_eq!(recording.point_id, ["P1", "P2", "P1", "P3"]);
    assert_eq!(recording.sequence, [1, 2, 3, 5]);
    // The clock starts again at 5 s: 500 s behind 30 s.
    assert_eq!(
        recording.time.as_deref().unwrap(),
        [0.0, 30.0, 530.0, 590.0]
    );
    let x: Vec<f64> = recording
        .position
        .iter()
        .map(|point| (point[0] * 1e6).round() / 1e3)
        .collect();
    assert_eq!(x, [1.0, 4.0, 7.0, 10.0]);
    let refused: Vec<(&str, i64)> = taken
        .rejected
        .0
        .iter()
        .map(|row| (row.file.as_str(), row.line))
        .collect();
    assert_eq!(
        refused,
        [("joints2.csv", 3), ("points2.csv", 4)],
        "P2 and P4 lack a partner on the second day"
    );
    let read: Vec<(&str, i64, i64)> = taken
        .intake
        .0
        .iter()
        .map(|row| (row.file.as_str(), row.read, row.accepted))
        .collect();
    assert_eq!(
        read,
        [
            ("joints1.csv", 2, 2),
            ("joints2.csv", 3, 2),
            ("points1.csv", 2, 2),
            ("points2.csv", 3, 2)
        ]
    );
}

#[test]
fn a_clock_that_goes_on_is_left_alone() {
    let later = "id,t,q1,q2\nP1,86400,12,22\nP3,86430,13,23\n";
    let taken = take(
        &desk().with("joints2.csv", later),
        &format!("{DAYS}max_rejected_fraction: 0.6\n"),
        rr(),
    );
    let times = taken.unwrap().recording.time.unwrap();
    assert_eq!(times, [0.0, 30.0, 86400.0, 86430.0]);
}

#[test]
fn what_a_later_measurement_lacks_is_said_with_its_place() {
    let yaml = DAYS
        .replace("[joints2.csv, points2.csv]", "[joints2.csv]")
        .replace("500", "-1");
    let faults: Vec<String> = faults_of(&yaml);
    assert_eq!(
        faults,
        [
            "later[0].files: 1 file here; allowed: one for each of the 2 under `files`",
            "later[0].gap_s: allowed: 0 or more, s"
        ]
    );
    let without = desk().with("points2.csv", "id,x,y\nP1,7,8\n");
    let printed = refusal(&without, DAYS, rr());
    has(&printed, ["points2.csv", "`z`"]);
}

#[test]
fn the_files_of_an_earlier_measurement_again_are_a_fault_of_the_settings() {
    let faults = |files: &str| -> Vec<String> {
        settings(&DAYS.replace("[joints2.csv, points2.csv]", files))
            .check()
            .iter()
            .map(ToString::to_string)
            .collect()
    };
    let again = faults("[./joints1.csv, points1.csv]");
    assert!(
        again.len() == 1 && again[0].starts_with("later[0].files: the files of `files` again: "),
        "{again:?}"
    );
    let third = faults("[joints2.csv, points2.csv]\n  - files: [joints2.csv, points2.csv]");
    assert!(
        third.len() == 1
            && third[0].starts_with("later[1].files: the files of `later[0].files` again: "),
        "{third:?}"
    );
    // Of a program that moves the robot on both days, or of one log of both, one path is the same.
    assert!(
        faults("[joints1.csv, points2.csv]").is_empty()
            && faults("[joints2.csv, points1.csv]").is_empty()
    );
}

#[test]
fn points_that_would_be_used_twice_are_refused_whatever_their_file_is_called() {
    let copied = desk().with("points2.csv", "id,x,y,z\r\nP2,4,5,6\r\nP1,1,2,3.0\r\n");
    let printed = refusal(&copied, DAYS, rr());
    let expected = "with.later[0].files[1]: `points2.csv` measured what `points1.csv` of `files[1].file` did, and 2 rows would be used \
                    twice";
    starts_with(&printed, expected);
}

#[test]
fn one_log_of_two_days_is_no_copy() {
    let log = "id,x,y,z\nP2,4,5,6\nP1,1,2,3\nP3,7,8,9\n";
    let days = Desk::default()
        .with("joints1.csv", "id,t,q1,q2\nP1,0,10,20\nP2,30,11,21\n")
        .with("joints2.csv", "id,t,q1,q2\nP3,5,12,22\n")
        .with("points1.csv", log);
    let yaml = DAYS.replace("points2.csv", "points1.csv") + "max_rejected_fraction: 0.7\n";
    let taken = take(&days, &yaml, rr()).unwrap();
    assert_eq!(taken.recording.point_id, ["P1", "P2", "P3"]);
}
