//! Raw files become a recording; what does not is named with file, line and reason.

mod clocks;
mod counting;
mod external;
mod feather;
mod foreign;
mod kinds;
mod later;
mod long;
mod moving;
mod noise;
mod programs;
mod refusals;
mod together;
mod wide;
mod workbooks;

use crate::answer::read;
use crate::desk::{Desk, shared, table};
use calib::error::{Error, Result};
use calib::robot::SigmaSource;
use calib::stage::ingest::{Ingest, IngestReads};
use calib::store::frame::Frame;
use calib::table::{Intake, Recording, Rejected, Robot, RobotRow};
use std::collections::BTreeMap;

/// A robot table with limits of half a turn (revolute, `r`) or 0 to 3 m (prismatic, `p`).
pub fn robot(kinds: &str, half_turns: f64) -> Robot {
    let row = |(kind, body): (char, i64)| RobotRow {
        body,
        name: format!("J{body}"),
        kind: if kind == 'p' { "prismatic" } else { "revolute" }.into(),
        axis_x: Some(0.0),
        axis_y: Some(0.0),
        axis_z: Some(1.0),
        point_x_mm: Some(0.0),
        point_y_mm: Some(0.0),
        point_z_mm: Some(0.0),
        lower_rad: (kind == 'r').then_some(-half_turns * std::f64::consts::PI),
        upper_rad: (kind == 'r').then_some(half_turns * std::f64::consts::PI),
        lower_mm: (kind == 'p').then_some(0.0),
        upper_mm: (kind == 'p').then_some(3000.0),
        ..Default::default()
    };
    Robot(kinds.chars().zip(1..).map(row).collect())
}

/// Two revolute joints of half a turn either way.
fn rr() -> Robot {
    robot("rr", 1.0)
}

/// What a run of the stage gives.
struct Taken {
    recording: Recording,
    rejected: Rejected,
    intake: Intake,
}

fn settings(yaml: &str) -> Ingest {
    let options = serde_saphyr::options! { strict_booleans: true };
    serde_saphyr::from_str_with_options(yaml, options).unwrap()
}

fn faults_of(yaml: &str) -> Vec<String> {
    let faults = calib::stage::Stage::check(&settings(yaml));
    faults.iter().map(ToString::to_string).collect()
}

fn take(desk: &Desk, yaml: &str, robot: Robot) -> Result<Taken> {
    taken(desk.run(&settings(yaml), IngestReads { robot })?)
}

fn taken(tables: BTreeMap<&'static str, Vec<Frame>>) -> Result<Taken> {
    let mut chunks = table::<Recording>(&tables).into_iter();
    let first = chunks.next().unwrap();
    assert!(chunks.next().is_none(), "more than one chunk");
    let rejected = table::<Rejected>(&tables).into_iter();
    let taken = Taken {
        recording: first,
        rejected: Rejected(rejected.flat_map(|chunk| chunk.0).collect()),
        intake: table::<Intake>(&tables).remove(0),
    };
    for file in &taken.intake.0 {
        assert_eq!(file.accepted + file.rejected, file.read, "{}", file.file);
        let rejected = taken.rejected.0.iter();
        let listed = rejected.filter(|row| row.file == file.file).count() as i64;
        assert_eq!(listed, file.rejected, "{}", file.file);
    }
    Ok(taken)
}

fn refusal(desk: &Desk, yaml: &str, robot: Robot) -> String {
    match take(desk, yaml, robot) {
        Err(Error::Data(faults)) => {
            let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
            faults.join("\n")
        }
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("was accepted"),
    }
}

/// Two revolute joints, everything in one file `a.csv`.
const TWO: &str = r#"
files:
  - file: a.csv
    columns:
      point_id: {column: id}
      q: {column: "q{j}", unit: deg}
      x: {column: x, unit: mm}
      y: {column: y, unit: mm}
      z: {column: z, unit: mm}
"#;
const HEAD: &str = "id,q1,q2,x,y,z\n";

fn rows(text: &str) -> Desk {
    Desk::default().with("a.csv", format!("{HEAD}{text}"))
}

/// Good rows named `g1`, `g2`, ...
fn good(count: usize) -> String {
    (1..=count)
        .map(|row| format!("g{row},{row},20,100.5,200,{row}\n"))
        .collect()
}

#[test]
fn quantities_arrive_in_si_under_the_names_of_the_file() {
    let taken = take(
        &rows("P1,180,-90,1000,-2000.5,3\nP2,10,20,4,5,6\n"),
        TWO,
        rr(),
    )
    .unwrap();
    let recording = &taken.recording;
    assert_eq!(recording.point_id, ["P1", "P2"]);
    assert_eq!(recording.sequence, [1, 2]);
    assert_eq!(
        recording.q(0),
        [std::f64::consts::PI, -std::f64::consts::FRAC_PI_2]
    );
    assert_eq!(recording.position[0], [1.0, -2.0005, 0.003]);
    assert_eq!((&recording.time, &recording.current), (&None, &None));
    assert_eq!(recording.usage, [None, None]);
}

#[test]
fn every_refused_row_has_its_line_reason_and_text() {
    let bad = "B1,1,2,,2,3|blank|x is blank
B2,1,abc,1,2,3|not_a_number|q2: `abc` is not a number
B3,1,2,1,NaN,3|not_a_number|y: `NaN` is not a finite number
B4,1,2,1,2,inf|not_a_number|z: `inf` is not a finite number
B5,1,2,1|short_row|4 fields; allowed: 6
B6,1,2,1,2,3,4|long_row|7 fields; allowed: 6
B7,1,2,0,0.0,0|lost_beam|the position is 0, 0, 0: the tracker saw nothing
,1,2,1,2,3|blank|point_id is blank
,,,,,|blank|the whole row is blank
B8,1,2,1e6,2,3|out_of_range|x: `1e6`; allowed: -200000 to 200000 mm
B9,1,2000,1,2,3|out_of_range|q2: `2000`; allowed: -1145.91559 to 1145.91559 deg
g1,1,2,1,2,3|duplicate_id|point id `g1` also stands on line 14";
    let row = |line: &str| line.split('|').next().unwrap().to_string() + "\n";
    let text: String = bad.lines().map(row).collect();
    // g1 again, so both are refused; trailing delimiters make no long row.
    let file = rows(&format!("{text}{}T1,1,2,3,4,5,,\n", good(20)));
    let taken = take(&file, TWO, rr()).unwrap_or_else(|error| panic!("{error}"));
    for ((line, expected), row) in (2..).zip(bad.lines()).zip(&taken.rejected.0) {
        let found = format!("{}|{}|{}", row.text, row.reason, row.detail);
        assert_eq!((found.as_str(), row.line), (expected, line));
        assert_eq!(row.file, "a.csv");
    }
    let last = taken.rejected.0.last().unwrap();
    assert_eq!((last.line, last.reason.as_str()), (14, "duplicate_id"));
    assert_eq!(last.detail, "point id `g1` also stands on line 13");
    assert_eq!(last.point_id.as_deref(), Some("g1"));
    let intake = &taken.intake.0[0];
    assert_eq!(
        (intake.lines, intake.read, intake.accepted, intake.rejected),
        (34, 33, 20, 13)
    );
    assert_eq!(
        taken.recording.sequence[0], 14,
        "the sequence counts data rows, refused ones too"
    );
}

const CASE: &str = r#"
files:
  - file: CASE/controller.csv
    columns:
      point_id: {column: point_id}
      usage: {column: use}
      payload: {column: payload_kg, unit: kg}
      temperature: {column: temp_c, unit: C, optional: true}
      q: {column: "q{j}_deg", unit: deg}
      current: {column: "i{j}_a", unit: A, optional: true}
      direction: {column: "dir{j}", optional: true}
  - file: CASE/tracker.csv
    columns:
      point_id: {column: point_id}
      time: {column: time_s, unit: s, optional: true}
      x: {column: x_mm, unit: mm}
      y: {column: y_mm, unit: mm}
      z: {column: z_mm, unit: mm}
join: {by: id}
"#;

#[test]
fn the_practice_recordings_join_fully() {
    let Some(root) = shared("practice") else {
        return;
    };
    let mut folders: Vec<_> = std::fs::read_dir(root)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_dir())
        .collect();
    folders.sort();
    assert_eq!(folders.len(), 28);
    for folder in folders {
        let arm = read(folder.join("robot.json"));
        let arm: serde_json::Value = serde_json::from_str(&arm).unwrap();
        let joints = arm["axes"].as_array().unwrap().len();
        let desk = Desk::default();
        let taken = take(
            &desk,
            &CASE.replace("CASE", &folder.display().to_string()),
            robot(&"r".repeat(joints), 2.0),
        )
        .unwrap();
        assert_eq!(taken.recording.rows(), 240, "{}", folder.display());
        assert_eq!(taken.rejected.0, []);
        assert_eq!(
            taken
                .intake
                .0
                .iter()
                .map(|file| (file.file.as_str(), file.lines))
                .collect::<Vec<_>>(),
            [("controller.csv", 241), ("tracker.csv", 241)]
        );
        let labels: std::collections::BTreeSet<_> =
            taken.recording.usage.iter().flatten().collect();
        assert_eq!(labels.into_iter().collect::<Vec<_>>(), ["fit", "validate"]);
        let lacks = folder.ends_with("p10_drift_no_temp");
        assert_eq!(taken.recording.temperature.is_none(), lacks);
        assert_eq!(
            desk.notes
                .lock()
                .unwrap()
                .iter()
                .any(|note| note.contains("no column `temp_c`")),
            lacks
        );
        assert_eq!(desk.warnings.lock().unwrap().as_slice(), [""; 0]);
    }
}

const UR10: &str = r#"
files:
  - file: FILE
    delimiter: ";"
    decimal: comma
    columns:
      q:
        columns: [shoulder_pan_joint, shoulder_lift_joint, elbow_joint, wrist_1_joint, wrist_2_joint, wrist_3_joint]
        unit: rad
      temperature: {column: measurement_temperature, unit: C}
      x: {column: measurement_x, unit: mm}
      y: {column: measurement_y, unit: mm}
      z: {column: measurement_z, unit: mm}
      sigma_x: {column: measurement_std_x, unit: mm, optional: true}
      sigma_y: {column: measurement_std_y, unit: mm, optional: true}
      sigma_z: {column: measurement_std_z, unit: mm, optional: true}
"#;

#[test]
fn the_ur10_recordings_are_read_to_the_last_row() {
    let Some(root) = shared("data/ipa_ur10") else {
        return;
    };
    for (file, rows, sigma) in [
        ("Series_A/measurements_grid.csv", 11_911, false),
        ("Series_C/measurements_random_poses.csv", 2_773, true),
    ] {
        let yaml = UR10.replace("FILE", &root.join(file).display().to_string());
        let taken = take(&Desk::default(), &yaml, robot("rrrrrr", 2.0)).unwrap();
        let intake = &taken.intake.0[0];
        assert_eq!(
            (intake.lines, intake.read, intake.accepted, intake.rejected),
            (rows + 1, rows, rows, 0)
        );
        let source = if sigma {
            SigmaSource::Recorded
        } else {
            SigmaSource::Inferred
        };
        assert!(
            taken
                .recording
                .sigma_source
                .iter()
                .flatten()
                .filter(|ours| **ours == source)
                .count() as i64
                > rows - 5
        );
        assert_eq!(taken.recording.point_id[16], "row 17");
        if sigma {
            assert_eq!(
                taken.recording.q(1),
                [-4.08444, -2.6946, 1.69873, -2.031, 0.99275, -0.0673035]
            );
            assert!((taken.recording.position[1][1] - -3.1343677).abs() < 1e-15);
        }
    }
}
