//! Play of a gear in torques: while it is crossed after a reversal, the link's load and friction are not felt.

use super::{document, nothing, write};
use calib::twin::torque::TorqueCase;
use serde_json::Value;

/// An arm whose joints have friction, and nothing else is concealed; motor currents.
fn arm() -> TorqueCase {
    let drawn = (0..40).map(|number| TorqueCase::draw(&nothing(7), number));
    let fits = |case: &TorqueCase| {
        let friction = case.plain_friction();
        case.robot.name == "compact6" && friction.iter().all(|[v, c]| v.and(*c).is_some())
    };
    let mut fitting = drawn.filter(fits);
    fitting.next().unwrap()
}

/// Findings at a joint (from 1) that are no plain friction.
fn found(case: &TorqueCase, joint: usize) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("case");
    write(&at, &case.recording());
    let answer = document(&at, &folder.path().join("store"));
    let findings = answer["findings"].as_array().unwrap().iter();
    let plain = ["viscous_friction", "coulomb_friction"];
    let place = format!("joint {joint}");
    let here = findings.filter(|one| {
        one["where"] == place.as_str() && !plain.contains(&one["effect"].as_str().unwrap())
    });
    here.cloned().collect()
}

#[test]
fn play_of_a_gear_is_found_by_its_name_and_its_size() {
    // Friction behind the play: two times what the first joint has, and half of the greatest load of the fifth.
    for (joint, play, times) in [(1, 0.012, 6.0), (5, 0.02, 8.0)] {
        let case = arm();
        let coulomb = case.plain_friction()[joint - 1][1].unwrap();
        let case = case.with_play(joint - 1, play, times * coulomb);
        let found = found(&case, joint);
        let is_named = found.len() == 1 && found[0]["effect"] == "backlash";
        assert!(is_named, "joint {joint}: {found:#?}");
        let numbers = found[0]["parameters"].as_array().unwrap().iter();
        let size = numbers
            .clone()
            .find(|one| one["name"] == "play")
            .and_then(|one| one["value"].as_f64());
        assert!(
            size.is_some_and(|size| (size / play - 1.0).abs() < 0.25),
            "joint {joint}: {size:?}, truly {play}"
        );
    }
}

#[test]
fn friction_without_play_is_no_play() {
    let case = arm();
    let coulomb = case.plain_friction()[0][1].unwrap();
    let found = found(&case.with_drag(0, 5.0 * coulomb), 1);
    assert!(found.is_empty(), "{found:#?}");
}
