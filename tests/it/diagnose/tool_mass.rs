//! A mass on the flange that neither the robot file nor the payload column states is named as such.

use super::{calib, case_with, diagnosis, wanted};

#[test]
fn an_unstated_tool_is_named_beside_the_compliance_that_shows_it() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let design = "simulate conceal --out sealed --cases 1 --seed 8203 --points 120 --faulty 0";
    let effects =
        "--family joint_compliance --robot sr210d --natural 1 --other-forms 0 --tool-mass 40";
    calib(&format!("{design} {effects}"), here);
    case_with(here, &[]);
    let answer = diagnosis(here);
    let findings = answer["findings"].as_array().unwrap();
    let names = wanted(&answer["findings"]);
    let is_named = |effect: &str| names.iter().any(|(name, _)| name == effect);
    assert!(
        is_named("joint_compliance") && is_named("payload_error"),
        "{names:?}"
    );
    for other in [
        "joint_hardening",
        "cable_drag",
        "link_compliance",
        "link_mass",
    ] {
        assert!(!is_named(other), "{names:?}");
    }
    let numbers = findings
        .iter()
        .flat_map(|finding| finding["parameters"].as_array().into_iter().flatten());
    let mass = numbers.filter(|number| {
        number["name"]
            .as_str()
            .is_some_and(|name| name.ends_with("tool_mass"))
    });
    let mass: Vec<f64> = mass.filter_map(|number| number["value"].as_f64()).collect();
    assert!(mass.iter().any(|kg| (kg - 40.0).abs() < 6.0), "{mass:?} kg");
}
