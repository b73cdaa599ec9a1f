//! Several targets side by side in a row become rows of their own.

use super::{faults_of, refusal, rr, take};
use crate::answer::starts_with;
use crate::desk::Desk;

const WIDE: &str = r#"
files:
  - file: a.csv
    targets: {unit: mm, columns: {smr1: [X1, Y1, Z1], smr2: [X2, Y2, Z2], smr3: [7, 8, 9]}}
    columns:
      point_id: {column: id}
OWN"#;
const JOINTS: &str = "      q: {column: \"q{j}\", unit: deg}\n";
const ROWS: &str = "id,X1,Y1,Z1,X2,Y2,X3,Y3,Z3,Z2,q1,q2
P1,1,2,3,4,5,7,8,9,6,10,20
P2,11,12,13,,,17,18,19,,11,21
P3,,,,24,25,0,0,0,26,12,22
P4,1,2,3,4,5,7,8,,6,10,20
P5,,,,,,,,,,10,20
P6,1,2,3,4,five,7,8,9,6,10,20
P7,9e9,2,3,4,5,7,8,9,6,10,20
";

fn seen(recording: &calib::table::Recording) -> Vec<(i64, &str, &str, [f64; 3])> {
    let targets = recording.target.as_ref().unwrap();
    let millimetres = |row: usize| recording.position[row].map(|value| (value * 1e6).round() / 1e3);
    let row = |row: usize| {
        let target = targets[row].as_deref().unwrap();
        (
            recording.sequence[row],
            recording.point_id[row].as_str(),
            target,
            millimetres(row),
        )
    };
    (0..recording.rows()).map(row).collect()
}

/// By hand from the rows above.
const SEEN: [(i64, &str, &str, [f64; 3]); 6] = [
    (1, "P1", "smr1", [1.0, 2.0, 3.0]),
    (2, "P1", "smr2", [4.0, 5.0, 6.0]),
    (3, "P1", "smr3", [7.0, 8.0, 9.0]),
    (4, "P2", "smr1", [11.0, 12.0, 13.0]),
    (6, "P2", "smr3", [17.0, 18.0, 19.0]),
    (8, "P3", "smr2", [24.0, 25.0, 26.0]),
];

#[test]
fn a_wide_row_is_a_row_for_each_target_that_was_seen() {
    let yaml = WIDE
        .replace("OWN", JOINTS)
        .replace("[7, 8, 9]", "[X3, 8, 9]")
        + "max_rejected_fraction: 0.6\n";
    let taken = take(&Desk::default().with("a.csv", ROWS), &yaml, rr()).unwrap();
    assert_eq!(seen(&taken.recording), SEEN);
    assert_eq!(taken.recording.q(4), taken.recording.q(3), "P2 stands once");
    let refused: Vec<(i64, &str)> = taken
        .rejected
        .0
        .iter()
        .map(|row| (row.line, row.detail.as_str()))
        .collect();
    assert_eq!(
        refused,
        [
            (5, "the point of smr3 is incomplete"),
            (6, "nothing was measured in this row"),
            (7, "Y2: `five` is not a number"),
            (8, "X1: `9e9`; allowed: -200000 to 200000 mm"),
        ]
    );
    assert_eq!((taken.intake.0[0].read, taken.intake.0[0].accepted), (7, 3));
}

#[test]
fn a_wide_file_of_points_is_joined_to_the_joints_by_its_rows() {
    let joints = "n,q1,q2\nP3,12,22\nP2,11,21\nP1,10,20\n";
    let other = "  - file: joints.csv\n    columns:\n      point_id: {column: n}\n";
    let of_points = WIDE.replace("OWN", "");
    let desk = || {
        Desk::default()
            .with("a.csv", ROWS)
            .with("joints.csv", joints)
    };
    let first = format!("{of_points}{other}{JOINTS}join: {{by: id}}\nmax_rejected_fraction: 0.6\n");
    let taken = take(&desk(), &first.replace("[7, 8, 9]", "[X3, 8, 9]"), rr()).unwrap();
    assert_eq!(seen(&taken.recording), SEEN);
    let body = of_points.trim_start().strip_prefix("files:\n").unwrap();
    let second =
        format!("files:\n{other}{JOINTS}{body}join: {{by: id}}\nmax_rejected_fraction: 0.6\n");
    let taken = take(&desk(), &second, rr()).unwrap();
    let (ids, targets): (Vec<&str>, Vec<&str>) = seen(&taken.recording)
        .iter()
        .map(|row| (row.1, row.2))
        .unzip();
    assert_eq!(
        ids,
        ["P3", "P2", "P2", "P1", "P1", "P1"],
        "in the order of the joints"
    );
    assert_eq!(targets, ["smr2", "smr1", "smr3", "smr1", "smr2", "smr3"]);
    assert_eq!(
        taken.recording.q(0),
        [12f64.to_radians(), 22f64.to_radians()]
    );
}

#[test]
fn faults_of_targets_have_their_places() {
    let faults = |yaml: &str| faults_of(yaml);
    let whole = WIDE.replace("OWN", JOINTS);
    assert_eq!(faults(&whole), [""; 0]);
    assert_eq!(
        faults(&whole.replace("unit: mm, columns", "unit: deg, columns")),
        ["files[0].targets.unit: `deg` is no unit of length; allowed: mm, um, m, in"]
    );
    let twice = WIDE.replace(
        "OWN",
        &format!(
            "{JOINTS}      x: {{column: X1, unit: mm}}\n      y: {{column: Y1, unit: mm}}\n      z: {{column: Z1, unit: mm}}\n"
        ),
    );
    assert_eq!(faults(&twice).len(), 3);
    assert_eq!(
        faults(&twice)[0],
        "files[0].columns.x: also in `targets`; map it in one of them"
    );
    let missing = refusal(
        &Desk::default().with("a.csv", ROWS.replace("Y2", "YY2")),
        &whole,
        rr(),
    );
    starts_with(&missing, "a.csv:1: no column `Y2`, mapped to `smr2`");
}
