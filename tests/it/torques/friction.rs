//! Dry friction that torques show says on which side of a gap a joint comes to rest: both recordings of an arm in one pipeline.

use super::masses::table;
use super::results::{arm, calib};
use super::write;
use calib::table::{FindingNumbers, Findings};
use std::path::Path;

/// Joint that has lost motion, from 1, and its whole gap, arcsec.
const JOINT: usize = 3;
const GAP: f64 = 16.0;

const PIPELINE: &str = r#"
calib: 1
name: friction
seed: 3
stages:
  - id: truth
    uses: robot
    with: {file: case/robot.json, format: case}
  - uses: ingest_torques
    with:
      files:
        - file: case/recording.csv
          columns:
            time: {column: time_s, unit: s}
            trajectory: {column: traj}
            usage: {column: use}
            q: {column: "q{j}_deg", unit: deg}
            current: {column: "i{j}_a", unit: A}
  - uses: diagnose_torques
  - uses: masses
  - uses: simulate
    reads: {robot: truth}
    with:
      effects: [{backlash: {joint: 3, gap_arcsec: GAP, closing_nm: FRICTION}}]
      tracker: {position_mm: [2500, -900, 601], noise_um: 10, noise_um_per_m: 2.5, coverage: 2}
      poses: {range_deg: [[-90, 90], [-140, -40], [-55, 95], [-120, 120], [-80, 80], [-160, 160]]}
      blocks: [{usage: fit, points: 71}, {usage: validate, points: 40}]
  - uses: split
    with: {by: usage}
  - id: alone
    uses: diagnose
    reads: {robot: truth}
  - id: together
    uses: diagnose
"#;

/// What a diagnosis says of the gap; half of it with its standard deviation, arcsec.
fn gap(store: &Path, stage: &str) -> (String, [f64; 2]) {
    let Findings(rows) = table(store, &format!("{stage}/findings"));
    let FindingNumbers(numbers) = table(store, &format!("{stage}/finding_numbers"));
    let place = format!("joint {JOINT}");
    let found = rows.into_iter().find(|row| row.effect == "backlash" && row.place == place).expect("a gap");
    let half = numbers.into_iter().find(|number| number.rank == found.rank).expect("its size");
    (found.statement, [half.value, half.sigma.expect("its sigma")])
}

#[test]
fn a_gap_whose_side_the_loads_seem_to_decide_is_left_to_approach_below_the_friction_of_the_torques() {
    let case = arm();
    let friction = case.plain_friction()[JOINT - 1][1].expect("friction");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    write(&at("case"), &case.recording());
    let text = PIPELINE.replace("GAP", &GAP.to_string()).replace("FRICTION", &friction.to_string());
    std::fs::write(at("pipeline.yaml"), text).expect("a file");
    let output = calib(&["run", "--quiet", &at("pipeline.yaml").display().to_string()], &at("store"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let [(alone, before), (together, after)] = ["alone", "together"].map(|stage| gap(&at("store"), stage));
    println!("friction {friction:.2} Nm; alone: {alone} {before:.2?}; together: {together} {after:.2?}");
    assert!(!alone.contains("approach"), "{alone}");
    let said = together.split(" Nm").next().and_then(|text| text.rsplit(' ').next()).expect("Nm");
    assert!((said.parse::<f64>().expect("a number") / friction - 1.0).abs() < 0.03, "{together}");
    let [half, sigma] = after;
    assert!((half - 0.5 * GAP).abs() < 3.0 * sigma && sigma <= before[1], "{after:?}, {before:?}");
}
