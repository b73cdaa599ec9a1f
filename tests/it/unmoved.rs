//! What stands while an arm is measured: one pose is no geometry, and a joint that never moves is said.

use crate::answer::{calib, has, put};
use crate::compensate::ROBOT;
use crate::fixture::robot_of;
use calib::robot::RobotModel;
use std::path::Path;

const PIPELINE: &str = "calib: 1
name: still
seed: 1
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: poses.csv
          columns:
            q: {column: \"q{j}\", unit: deg}
            x: {column: x, unit: mm}
            y: {column: y, unit: mm}
            z: {column: z, unit: mm}
      duplicates: keep
  - uses: split
    with: {by: every, n: 5}
  - id: STEP
    uses: USES
";

/// The cell's arm at joints of a row (deg), each point displaced along x by a creep, mm.
fn message_of(
    folder: &Path,
    uses: &str,
    joints: impl Fn(usize) -> [f64; 6],
    creep: impl Fn(usize) -> f64,
) -> (Option<i32>, String) {
    let arm = RobotModel::new(robot_of(ROBOT));
    let mut text = String::from("q1,q2,q3,q4,q5,q6,x,y,z\n");
    for row in 0..50 {
        let q = joints(row);
        let p = arm.forward(&q.map(f64::to_radians)).translation * 1e3;
        let noise = |k: usize| 0.003 * ((row * 7 + k * 13) as f64).sin();
        let cells =
            q.into_iter()
                .chain([p.x + creep(row) + noise(0), p.y + noise(1), p.z + noise(2)]);
        text.push_str(
            &(cells
                .map(|x| format!("{x:.6}"))
                .collect::<Vec<_>>()
                .join(",")
                + "\n"),
        );
    }
    put(folder, "poses.csv", text);
    put(folder, "robot.yaml", ROBOT);
    put(
        folder,
        "pipeline.yaml",
        PIPELINE.replace("USES", uses).replace("STEP", uses),
    );
    let output = calib(folder, "run pipeline.yaml");
    (output.code, output.err.clone())
}

#[test]
fn one_pose_measured_fifty_times_is_no_geometry_and_its_creep_is_told() {
    for uses in ["identify", "diagnose"] {
        let folder = tempfile::tempdir().unwrap();
        let (code, printed) = message_of(
            folder.path(),
            uses,
            |_| [10.0, 20.0, -30.0, 40.0, 50.0, 60.0],
            |row| 0.2 * row as f64 / 49.0,
        );
        assert_eq!(code, Some(10), "{printed}");
        has(
            &printed,
            "all 40 rows to fit are of one pose: geometry needs poses in which every joint moves",
        );
        let drift = printed
            .split("the point drifts by ")
            .nth(1)
            .and_then(|text| text.split(" mm").next());
        let drift = drift
            .and_then(|mm| mm.parse::<f64>().ok())
            .unwrap_or_else(|| panic!("{printed}"));
        assert!((drift - 0.2).abs() < 0.01, "{printed}");
    }
    let folder = tempfile::tempdir().unwrap();
    let (code, printed) = message_of(folder.path(), "identify", |_| [10.0; 6], |_| 0.0);
    assert!(
        code == Some(10) && printed.contains("the point does not drift beyond noise"),
        "{printed}"
    );
}

#[test]
fn a_joint_that_never_moves_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let swing = |row: usize, joint: usize| 50.0 * ((1.3 * row as f64 + 0.9 * joint as f64).sin());
    let joints = |row: usize| {
        [0, 1, 2, 3, 4, 5].map(|joint| if joint == 3 { 12.5 } else { swing(row, joint) })
    };
    let (code, printed) = message_of(folder.path(), "identify", joints, |_| 0.0);
    assert_eq!(code, Some(0), "{printed}");
    has(
        &printed,
        "never moves in the 41 rows to fit: joint 4 (at 12.500 deg)",
    );
}
