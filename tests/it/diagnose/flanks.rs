//! Two flanks of a gear's teeth that err differently: an error periodic in the joint angle whose sign follows the approach.

use super::{Named, calib, concealed, wanted};
use serde_json::Value;

const FLANKS: &str = "
calib: 1
name: flanks
seed: 8
stages:
  - uses: robot
    with: {file: sealed/recordings/c0001/robot.json, format: case}
  - uses: simulate
    with:
      truth: {offset_deg: [0.02, -0.01, 0.03, 0, 0.01, 0]}
      effects: [{gear_flank: {joint: 2, order: 5, amplitude_arcsec: 35, phase_deg: 40}}]
      poses: {range_deg: [[-90, 90], [-140, -40], [-55, 95], [-120, 120], [-75, 75], [-160, 160]]}
      blocks: [{usage: fit, points: 160}, {usage: validate, points: 40}]
  - uses: split
    with: {by: usage}
  - uses: diagnose
";

#[test]
fn flanks_that_err_differently_are_named_with_their_order_and_amplitude() {
    let folder = concealed("backlash", "31", "40");
    std::fs::write(folder.path().join("p.yaml"), FLANKS).expect("written");
    let said: Value = serde_json::from_str(&calib(&["diagnose", "p.yaml", "--json", "--quiet"], folder.path())).expect("JSON");
    assert_eq!(wanted(&said["findings"]), Named::from([("gear_flank".into(), "joint 2".into())]), "{said:#}");
    let finding = &said["findings"][0];
    let number = |k: usize, name: &str| finding["parameters"][k][name].as_f64().expect("a number");
    // sin(5 q + 40 deg) = cos(40 deg) sin(5 q) + sin(40 deg) cos(5 q)
    let (sine, cosine) = 40f64.to_radians().sin_cos();
    for (k, truth) in [35.0 * sine, 35.0 * cosine].into_iter().enumerate() {
        assert!((number(k, "value") - truth).abs() < 4.0 * number(k, "sigma"), "{finding:#}");
        assert!(number(k, "sigma") < 4.0, "{finding:#}");
    }
    let statement = finding["statement"].as_str().expect("a sentence");
    assert!(statement.contains("the two flanks of the teeth of joint 2 err differently: 5 times a turn by 3"), "{statement}");
}
