//! Dry friction that torques show says on which side of a gap a joint comes to rest: both recordings of an arm in one pipeline.

use super::masses::table;
use super::results::{arm, calib};
use super::write;
use calib::table::{FindingNumbers, Findings};
use std::path::Path;

/// Joint that has lost motion, from 1.
const JOINT: usize = 3;

const PIPELINE: &str = r#"
calib: 1
name: friction
seed: SEED
stages:
  - uses: robot
    with: {file: case/robot.json, format: case}
  - uses: simulate
    with:
      truth: {compliance_rad_nm: [0, 6.0e-6, 9.0e-6, 0, 0, 0]}
      effects: [{backlash: {joint: 3, gap_arcsec: GAP, closing_nm: FRICTION}}]
      tracker: {position_mm: [2500, -900, 600], noise_um: 10, noise_um_per_m: 2.5, coverage: 2}
      poses: {range_deg: [[-90, 90], [-60, 40], [-50, 50], [-120, 120], [-80, 80], [-160, 160]]}
      blocks: [{usage: fit, points: POINTS}, {usage: validate, points: 40}]
  - uses: split
    with: {by: usage}
  - id: alone
    uses: diagnose
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
  - id: together
    uses: diagnose
"#;

/// What a diagnosis says of the gap.
#[derive(Debug)]
struct Gap {
    probability: f64,
    /// arcsec.
    half: f64,
    sigma: f64,
    statement: String,
}

fn gap(store: &Path, stage: &str) -> Option<Gap> {
    let Findings(rows) = table(store, &format!("{stage}/findings"));
    let FindingNumbers(numbers) = table(store, &format!("{stage}/finding_numbers"));
    let found = rows.into_iter().find(|row| row.effect == "backlash" && row.place == format!("joint {JOINT}"))?;
    let half = numbers.into_iter().find(|number| number.rank == found.rank)?;
    let probability = found.probability?;
    Some(Gap { probability, half: half.value, sigma: half.sigma?, statement: found.statement })
}

/// Said of a gap (arcsec) by positions alone and with the torques, and the true friction, Nm.
fn said(gap_arcsec: f64, points: usize, seed: u64) -> ([Option<Gap>; 2], f64) {
    let case = arm();
    let friction = case.plain_friction()[JOINT - 1][1].expect("friction");
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    write(&at("case"), &case.recording());
    let numbers = [("SEED", seed as f64), ("GAP", gap_arcsec), ("FRICTION", friction), ("POINTS", points as f64)];
    let text = numbers.iter().fold(PIPELINE.to_string(), |text, (name, value)| text.replace(name, &value.to_string()));
    std::fs::write(at("pipeline.yaml"), text).expect("a file");
    let output = calib(&["run", "--quiet", &at("pipeline.yaml").display().to_string()], &at("store"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    (["alone", "together"].map(|stage| gap(&at("store"), stage)), friction)
}

#[test]
#[ignore = "prints figures"]
fn figures_of_gaps_without_and_with_torques() {
    for gap_arcsec in [8.0, 12.0, 16.0, 24.0] {
        for seed in 1..=5 {
            println!("{gap_arcsec} arcsec: {:?}", said(gap_arcsec, 60, seed));
        }
    }
}
