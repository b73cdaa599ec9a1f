//! One arm in two recordings: what changed is found with its size, and nothing else.

use super::masses::table;
use super::results::{arm, calib};
use super::write;
use crate::answer::root;
use calib::table::{TorqueChangeRow, TorqueChangeTable};
use calib::twin::conceal::design::Design;
use calib::twin::torque::TorqueCase;
use serde_json::json;
use std::path::PathBuf;

/// Both cases through the pipeline of pairs.
fn compared(before: &TorqueCase, after: &TorqueCase) -> Vec<TorqueChangeRow> {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    write(&at("before"), &before.recording());
    write(&at("after"), &after.recording());
    let sets = ["before", "after"].map(|name| format!("{name}={}", at(name).display()));
    changes_of(&format!("--set {} --set {}", sets[0], sets[1]))
}

/// What the pipeline of pairs says with some settings.
fn changes_of(settings: &str) -> Vec<TorqueChangeRow> {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = pair().join("pipeline.yaml").display().to_string();
    calib(&format!("run --quiet {pipeline} {settings}"), folder.path()).code(0);
    let TorqueChangeTable(rows) = table(folder.path(), "compare_torques/changes");
    for row in rows.iter().filter(|row| row.rank.is_some()) {
        println!(
            "{}: {} +- {} {}, probability {}",
            row.name, row.change, row.sigma, row.unit, row.probability
        );
    }
    rows
}

fn pair() -> PathBuf {
    root("pipelines/dynamics_pair")
}

fn row<'a>(rows: &'a [TorqueChangeRow], name: &str) -> &'a TorqueChangeRow {
    rows.iter()
        .find(|row| row.name == name)
        .unwrap_or_else(|| panic!("no row {name}"))
}

/// Names of what changed.
fn changed(rows: &[TorqueChangeRow]) -> Vec<&str> {
    let changed = rows.iter().filter(|row| row.rank.is_some());
    let mut effects: Vec<&str> = changed.map(|row| row.effect.as_str()).collect();
    effects.dedup();
    effects
}

#[test]
fn a_payload_between_two_recordings_is_found_within_two_per_cent_and_ten_millimetres() {
    let before = arm();
    let after = before
        .clone()
        .on_other_paths(5077, 48.0)
        .carrying(2.0, [0.0; 3]);
    // What was added: the payload now less the payload then.
    let bodies = [&before, &after].map(|case| case.last_bodies().1.unwrap());
    let mass = bodies[1].mass - bodies[0].mass;
    let centre: [f64; 3] = std::array::from_fn(|axis| {
        (bodies[1].mass * bodies[1].centre[axis] - bodies[0].mass * bodies[0].centre[axis]) / mass
    });
    let rows = compared(&before, &after);
    assert_eq!(changed(&rows), ["payload"]);
    let found = row(&rows, "payload.mass");
    assert!(
        (found.change - mass).abs() < f64::min(0.02 * mass, 4.0 * found.sigma),
        "{} +- {} kg, truly {mass}",
        found.change,
        found.sigma
    );
    assert!(found.probability > 0.99);
    let off: f64 = ["payload.centre_x", "payload.centre_y", "payload.centre_z"]
        .iter()
        .zip(centre)
        .map(|(name, truth)| (row(&rows, name).change - truth).powi(2))
        .sum();
    assert!(
        off.sqrt() < 0.010,
        "the centre is {:.1} mm off",
        1e3 * off.sqrt()
    );
}

#[test]
fn friction_that_a_repair_changed_is_found_at_its_joint_and_nothing_else() {
    let before = arm();
    let size = 0.6 * before.plain_friction()[2][1].unwrap();
    let after = before.clone().on_other_paths(5078, 48.0).with_drag(2, size);
    let rows = compared(&before, &after);
    assert_eq!(changed(&rows), ["coulomb_friction"]);
    let found = row(&rows, "coulomb_friction.j3.coulomb");
    assert_eq!(found.rank, Some(1));
    assert!(
        (found.change - size).abs() < 0.1 * size,
        "{} +- {} Nm, truly {size}",
        found.change,
        found.sigma
    );
}

#[test]
fn an_arm_that_did_not_change_is_said_to_be_the_same() {
    let before = arm();
    let rows = compared(&before, &before.clone().on_other_paths(5079, 48.0));
    assert_eq!(changed(&rows), Vec::<&str>::new());
    assert!(
        rows.iter()
            .all(|row| row.rank.is_none() && row.sigma.is_finite())
    );
}

/// `CALIB_UPDATE=1` makes the example anew: the arm of `pipelines/dynamics/example` with a tool that its file does not declare.
#[test]
fn the_example_of_a_pair_shows_the_tool_that_was_added() {
    let example = pair().join("example");
    let (mass, shift) = (1.2, [0.0, 0.0, -0.02]);
    if std::env::var_os("CALIB_UPDATE").is_some() {
        let design = Design {
            seed: 11,
            cases: 1,
            other_forms: 0.0,
            seconds: 24.0,
            rate: 50.0,
            ..Design::default()
        };
        let before = TorqueCase::draw(&design, 0);
        let declared = before.last_bodies().1.unwrap();
        let after = before.on_other_paths(12, 24.0).carrying(mass, shift);
        let centre: [f64; 3] = std::array::from_fn(|axis| {
            declared.centre[axis] + (declared.mass + mass) * shift[axis] / mass
        });
        let truth = json!({ "payload_kg": mass, "centre_m": centre });
        let truth = serde_json::to_string_pretty(&truth).unwrap() + "\n";
        write(
            &example,
            &[after.recording()[1].clone(), ("truth.json", truth)],
        );
    }
    let truth = super::json(example.join("truth.json"));
    let rows = changes_of("");
    let found = row(&rows, "payload.mass");
    let mass = truth["payload_kg"].as_f64().unwrap();
    assert_eq!(found.rank, Some(1));
    assert!(
        (found.change - mass).abs() < 4.0 * found.sigma && found.sigma < 0.1 * mass,
        "{} +- {}",
        found.change,
        found.sigma
    );
}
