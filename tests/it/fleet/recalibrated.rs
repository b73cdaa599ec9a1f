//! A fleet measured again: what changed is flagged with its reason, what did not is left in peace.

use super::{fleet, output, write};
use crate::answer::{read, root};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;

const ROBOTS: usize = 24;
/// Robot, joint (from 1), change of its zero, deg.
const CHANGED: [(usize, usize, f64); 3] = [(4, 3, 0.02), (11, 2, -0.015), (17, 5, 0.05)];

/// A list of twins with errors of their own; `shift` adds to the zero of a joint.
fn list(folder: &Path, name: &str, campaign: usize, shift: impl Fn(usize, usize) -> f64) {
    let mut text =
        "robot,model,set.simulate.seed,set.simulate.truth.offset_deg,set.simulate.truth.links,set.simulate.tracker.position_mm\n"
            .to_string();
    let noise = |robot: usize, k: usize| 2.0 * crate::fixture::spread(robot * 31 + k, k) - 1.0;
    for robot in 0..ROBOTS {
        let offsets: Vec<String> = (0..6)
            .map(|j| format!("{:.6}", 0.1 * noise(robot, j) + shift(robot, j + 1)))
            .collect();
        let links: Vec<String> = (1..=5)
            .map(|link| {
                let at = |k: usize| 0.5 * noise(robot, 6 + 3 * link + k);
                format!(
                    "{{link: {link}, shift_mm: [{:.5}, {:.5}, {:.5}]}}",
                    at(0),
                    at(1),
                    at(2)
                )
            })
            .collect();
        let place = 4500 + 37 * robot * (campaign + 1);
        writeln!(
            text,
            "robot {robot},sr210d,{},\"[{}]\",\"[{}]\",\"[{place}, -1800, 900]\"",
            1000 * campaign + robot,
            offsets.join(", "),
            links.join(", ")
        )
        .unwrap();
    }
    write(folder.join(format!("{name}.csv")), &text);
}

fn pipeline(folder: &Path) {
    let robot = root("pipelines/sr210d/robot.yaml");
    let text = format!(
        "calib: 1\nname: twins\nseed: 5\nstages:\n  - uses: robot\n    with: {{file: {}}}\n  - uses: simulate\n    with:\n      \
         truth: {{}}\n      tracker: {{position_mm: [4500, -1800, 900], roll_pitch_yaw_deg: [0.3, -0.2, 155]}}\n      \
         poses: {{range_deg: [[-90, 90], [-40, 60], [-55, 55], [-120, 120], [-75, 75], [-160, 160]]}}\n      \
         blocks: [{{usage: fit, points: 60}}, {{usage: validate, points: 15}}]\n  - uses: split\n    with: {{by: usage}}\n  \
         - {{id: nominal, uses: identify, with: {{effects: [base_frame], folds: 0}}}}\n  - {{id: joint, uses: identify, with: \
         {{effects: [base_frame, tool_offset, joint_offset, link_geometry], folds: 0}}}}\n  - uses: compare\n  - uses: validate\n",
        robot.display()
    );
    write(folder.join("twins.yaml"), &text);
}

fn campaign(folder: &Path, name: &str, date: &str, tail: &str) -> Value {
    let text = format!(
        "calib: 1\nname: {name}\npipeline: twins.yaml\ngroups: {{campaign: {date}}}\nrobots:\n  - list: {name}.csv\n{tail}"
    );
    let file = write(folder.join(format!("{name}.yaml")), &text);
    let (result, printed) =
        output(fleet("run", &file, &folder.join("store")).args(["--json", "--quiet"]));
    assert!(result.status.success(), "{printed}");
    serde_json::from_slice(&result.stdout).unwrap()
}

#[test]
fn changed_robots_are_flagged_with_the_joint_and_the_others_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    pipeline(folder);
    list(folder, "spring", 0, |_, _| 0.0);
    list(folder, "autumn", 1, |robot, joint| {
        CHANGED
            .iter()
            .filter(|(r, j, _)| (*r, *j) == (robot, joint))
            .map(|(_, _, by)| by)
            .sum()
    });
    campaign(folder, "spring", "2026-04-01", "");
    let answer = campaign(
        folder,
        "autumn",
        "2026-10-01",
        "previous: {fleet: spring}\n",
    );
    let flags: Vec<(usize, String)> = (0..)
        .zip(answer["robots"].as_array().unwrap())
        .filter_map(|(k, robot)| Some((k, robot["flags"].as_str()?.to_string())))
        .collect();
    assert_eq!(flags.len(), CHANGED.len(), "{flags:?}");
    for ((robot, joint, by), (flagged, reason)) in CHANGED.iter().zip(&flags) {
        assert_eq!(flagged, robot, "{flags:?}");
        let opening = format!("zero_shift joint {joint} since 2026-04-01: ");
        assert!(
            reason.starts_with(&opening) && !reason.contains(';'),
            "{reason}"
        );
        let value: f64 = reason[opening.len()..]
            .split(' ')
            .next()
            .unwrap()
            .parse()
            .unwrap();
        assert!((value - by).abs() < 0.2 * by.abs(), "{reason}: {by}");
    }
}

#[test]
fn a_robot_whose_diagnosis_changed_is_flagged_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    pipeline(folder);
    let text = read(folder.join("twins.yaml"));
    write(
        folder.join("twins.yaml"),
        &text.replace(
            "  - uses: compare\n",
            "  - uses: diagnose\n  - uses: compare\n",
        ),
    );
    for name in ["spring", "autumn"] {
        list(folder, name, usize::from(name == "autumn"), |_, _| 0.0);
        let rows = read(folder.join(format!("{name}.csv")));
        write(
            folder.join(format!("{name}.csv")),
            &rows
                .lines()
                .take(3)
                .fold(String::new(), |text, line| text + line + "\n"),
        );
    }
    campaign(folder, "spring", "2026-04-01", "");
    let gear = "{gear_cyclic: {joint: 3, order: 1, amplitude_arcsec: 60, phase_deg: 40}}";
    let worn =
        format!("overrides:\n  - {{robots: [robot 1], set: {{simulate.effects: [{gear}]}}}}\n");
    let answer = campaign(
        folder,
        "autumn",
        "2026-10-01",
        &format!("previous: {{fleet: spring}}\n{worn}"),
    );
    let flags = |robot: usize| {
        answer["robots"][robot]["flags"]
            .as_str()
            .unwrap_or_default()
    };
    assert_eq!(flags(0), "", "{answer}");
    assert!(
        flags(1).contains("gear_cyclic joint 3 since 2026-04-01: diagnosed, it was not before"),
        "{answer}"
    );
}

#[test]
fn robots_with_few_points_borrow_from_those_of_their_model() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    pipeline(folder);
    for name in ["many", "plain", "pooled"] {
        list(folder, name, usize::from(name != "many"), |_, _| 0.0);
    }
    campaign(folder, "many", "2026-04-01", "");
    let few = "set: {simulate.blocks: [{usage: fit, points: 20}, {usage: validate, points: 40}]}\n";
    let prior = "prior: {fleet: many, stage: joint, by: model, effects: [joint_offset, link_geometry, tool_offset]}\n";
    let rms = |answer: Value| -> Vec<f64> {
        answer["robots"]
            .as_array()
            .unwrap()
            .iter()
            .map(|robot| robot["after_rms_mm"].as_f64().unwrap())
            .collect()
    };
    let plain = rms(campaign(folder, "plain", "2026-10-01", few));
    let pooled = rms(campaign(
        folder,
        "pooled",
        "2026-10-01",
        &format!("{few}{prior}"),
    ));
    let better = plain
        .iter()
        .zip(&pooled)
        .filter(|(plain, pooled)| pooled < plain)
        .count();
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(
        better * 3 > ROBOTS * 2 && mean(&pooled) < mean(&plain),
        "{better} of {ROBOTS}: {plain:?} {pooled:?}"
    );
}
