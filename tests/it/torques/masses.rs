//! Masses that torques show end the mistake that a wrong robot file makes of compliance: both recordings of an arm in one pipeline.

use super::results::{arm, calib};
use super::write;
use calib::audit::QueryTables;
use calib::pipeline::{Manifest, find_run};
use calib::store::Store;
use calib::table::{Parameters, Robot, Table};
use serde_json::Value;
use std::path::Path;

/// True wind-up of joints 2 and 3, rad/Nm.
const TRULY: [f64; 2] = [6.0e-6, 9.0e-6];

const PIPELINE: &str = r#"
calib: 1
name: masses
seed: 3
stages:
  - id: truth
    uses: robot
    with: {file: truth/robot.json, format: case}
  - uses: simulate
    with:
      truth: {compliance_rad_nm: [0, 6.0e-6, 9.0e-6, 0, 0, 0]}
      tracker: {position_mm: [2500, -900, 600], noise_um: 10, noise_um_per_m: 2.5, coverage: 2}
      poses: {range_deg: [[-90, 90], [-60, 40], [-50, 50], [-120, 120], [-80, 80], [-160, 160]]}
      blocks: [{usage: fit, points: 150}]
  - id: believed
    uses: robot
    with: {file: believed/robot.json, format: case}
  - uses: ingest_torques
    with:
      files:
        - file: believed/recording.csv
          columns:
            time: {column: time_s, unit: s}
            trajectory: {column: traj}
            usage: {column: use}
            q: {column: "q{j}_deg", unit: deg}
            current: {column: "i{j}_a", unit: A}
  - uses: diagnose_torques
    with: {inertials: INERTIALS}
  - uses: masses
  - uses: split
    with: {by: usage}
  - id: before
    uses: identify
    with: {on: [fit], effects: [base_frame, tool_offset, joint_offset, joint_compliance]}
    reads: {robot: believed}
  - id: after
    uses: identify
    with: {on: [fit], effects: [base_frame, tool_offset, joint_offset, joint_compliance]}
"#;

/// Found over true wind-up of joints 2 and 3, before and after; the robot file's masses are `share` of the true ones.
fn ratios(inertials: &str, share: f64) -> ([f64; 2], [f64; 2]) {
    let case = arm();
    let [(name, robot), recording] = case.recording();
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write(&at("truth"), &[(name, robot.clone())]);
    let mut file: Value = serde_json::from_str(&robot).unwrap();
    for mass in file["mass"].as_array_mut().unwrap() {
        *mass = (share * mass.as_f64().unwrap()).into();
    }
    write(&at("believed"), &[(name, file.to_string()), recording]);
    let pipeline = at("pipeline.yaml");
    std::fs::write(&pipeline, PIPELINE.replace("INERTIALS", inertials)).unwrap();
    calib(&format!("run --quiet {}", pipeline.display()), &at("store")).code(0);
    let found = |stage: &str| compliances(&at("store"), stage);
    let of_found = |found: [f64; 2]| [found[0] / TRULY[0], found[1] / TRULY[1]];
    let masses: Robot = table(&at("store"), "masses/robot");
    assert_eq!(masses.to_description().unwrap().joints.len(), 6);
    (of_found(found("before")), of_found(found("after")))
}

pub(super) fn table<T: Table>(store: &Path, name: &str) -> T {
    let store = Store::open(store).unwrap();
    let run = find_run(&store, "HEAD").unwrap();
    let tables = QueryTables::of(&Manifest::of(&store, &run).unwrap());
    let table = tables.find(name).unwrap().table.clone();
    T::from_frame(&store.load(&table).unwrap()).unwrap()
}

fn compliances(store: &Path, stage: &str) -> [f64; 2] {
    let Parameters(rows) = table(store, &format!("{stage}/parameters"));
    let value = |joint: usize| {
        let name = format!("joint_compliance.j{joint}");
        rows.iter()
            .find(|row| row.name.starts_with(&name))
            .unwrap_or_else(|| panic!("no {name}"))
            .value
    };
    [value(2), value(3)]
}

#[test]
fn compliance_is_right_by_masses_from_torques_though_the_robot_files_masses_are_wrong() {
    let (before, after) = ratios("free", 1.0 / 1.5);
    println!(
        "found over true compliance of joints 2 and 3: {before:.3?} with the file's masses, {after:.3?} with those of the torques"
    );
    assert!(before.iter().all(|ratio| *ratio > 1.3), "{before:?}");
    assert!(
        after.iter().all(|ratio| (ratio - 1.0).abs() < 0.05),
        "{after:?}"
    );
}

#[test]
fn masses_that_are_right_stay_right() {
    let (before, after) = ratios("declared", 1.0);
    println!(
        "found over true compliance of joints 2 and 3: {before:.3?} with the file's masses, {after:.3?} with those of the torques"
    );
    assert!(
        before
            .iter()
            .chain(&after)
            .all(|ratio| (ratio - 1.0).abs() < 0.05),
        "{before:?} {after:?}"
    );
}
