//! What is missing is found where nothing but joints was recorded, and what befell ball and plates is said by rows.

use super::{fixture, socket, touched, touched_with, truth};
use crate::answer::has;
use crate::recorded::Recorded;
use calib::description::RobotDescription;
use calib::table::{Recording, VerdictRow, VerdictSentences, VerdictTopic};
use calib::twin::touch::Fixture;
use calib::twin::truth::TrueRobot;
use serde_json::json;

fn cell(points: usize) -> Vec<Fixture> {
    let places = [
        ("a/0", [480.0, 120.0, 300.0]),
        ("a/1", [480.0, 170.0, 300.0]),
        ("b/0", [-250.0, 450.0, 380.0]),
        ("b/1", [-250.0, 450.0, 430.0]),
        ("c/0", [100.0, -480.0, 320.0]),
        ("c/1", [100.0, -480.0, 370.0]),
    ];
    let sockets = places.map(|(name, place)| socket(name, place, points, 60.0));
    sockets.into()
}

/// The answer on a recording: causes by place, the verdict, what the data cannot show, all that was warned of.
struct Diagnosed {
    named: Vec<String>,
    verdict: VerdictRow,
    unseen: String,
    warnings: String,
}

fn diagnosed(robot: &RobotDescription, recording: Recording) -> Diagnosed {
    let made = Recorded::fitted(robot, recording).diagnose(json!({}));
    let (verdict, named) = (made.verdict(), made.named());
    let named = named
        .iter()
        .map(|(effect, place)| format!("{effect} at {place}"));
    let sentences: VerdictSentences = made.get();
    let unseen = sentences.about(&verdict.step, VerdictTopic::NotObservable);
    Diagnosed {
        named: named.collect(),
        unseen: unseen.join("\n"),
        verdict,
        warnings: made.warnings,
    }
}

#[test]
fn nothing_is_found_in_a_clean_recording_and_what_cannot_be_known_is_said() {
    let robot = fixture::seven();
    let clean = touched(&robot, &truth(&robot, 31), &cell(30), 31);
    let Diagnosed {
        named,
        verdict,
        unseen,
        warnings,
    } = diagnosed(&robot, clean);
    assert_eq!((named, &*verdict.verdict), (Vec::new(), "nothing_missing"));
    let closing = "anything below the repeatability of closing";
    has(&unseen, [closing, "scale of the arm", "place of the base"]);
    let silent = ["do not close", "sits elsewhere"];
    assert!(
        !silent.iter().any(|part| warnings.contains(part)),
        "{warnings}"
    );
}

#[test]
fn wind_up_cyclic_errors_and_lost_motion_are_named_at_their_joints() {
    let robot = fixture::seven();
    let compliance = vec![0.0, 3e-5, 0.0, 6e-5, 0.0, 0.0, 0.0];
    let gear = "[{gear_cyclic: {joint: 2, order: 3, amplitude_arcsec: 150, phase_deg: 40}}]";
    let gap = "[{backlash: {joint: 2, gap_arcsec: 250}}]";
    for (seed, compliance_rad_nm, effects, expected) in [
        (
            32,
            compliance,
            "[]",
            &["joint_compliance at joint 2", "joint_compliance at joint 4"][..],
        ),
        (33, Vec::new(), gear, &["gear_cyclic at joint 2"]),
        (36, Vec::new(), gap, &["backlash at joint 2"]),
    ] {
        let truth = TrueRobot {
            compliance_rad_nm,
            ..truth(&robot, seed)
        };
        let recording = touched_with(&robot, &truth, effects, &cell(30), seed);
        let Diagnosed { named, verdict, .. } = diagnosed(&robot, recording);
        for expected in expected {
            let found = named.iter().any(|name| name == expected);
            assert!(found, "{named:?}, {:?}", verdict.statement);
        }
    }
}

#[test]
fn a_ball_that_was_put_back_elsewhere_is_found() {
    let robot = fixture::seven();
    let before = truth(&robot, 37);
    let mut after = before.clone();
    after.links.last_mut().unwrap().shift_mm[0] += 1.5;
    let (mut recording, second) = (
        touched(&robot, &before, &cell(30), 37),
        touched(&robot, &after, &cell(30), 38),
    );
    let half = 90 * recording.joints;
    recording.q[half..].copy_from_slice(&second.q[half..]);
    let found = diagnosed(&robot, recording);
    let mut named = found.named.iter();
    let is_stated = found.warnings.contains("sits elsewhere on the tool")
        || named.any(|name| name.starts_with("tool_shift"));
    assert!(is_stated, "{:?}, {}", found.named, found.warnings);
}

#[test]
fn rows_of_a_plate_that_slipped_are_named_in_the_verdict() {
    let robot = fixture::seven();
    let mut recording = touched(&robot, &truth(&robot, 34), &cell(30), 34);
    let mut moved = cell(30);
    for one in &mut moved {
        one.centre_mm[0] += 1.5;
        one.centre_mm[2] += 1.0;
    }
    let slipped = touched(&robot, &truth(&robot, 34), &moved, 35);
    // Rows 20 to 25 of b/0, which is the third socket.
    let joints = recording.joints;
    recording.q[79 * joints..85 * joints].copy_from_slice(&slipped.q[79 * joints..85 * joints]);
    let found = diagnosed(&robot, recording);
    has(
        &found.warnings,
        ["6 rows do not close", "b/0-0020 to b/0-0025 (6 rows)"],
    );
    let statement = found.verdict.statement.unwrap_or_default();
    has(&statement, "ball or fixture moved there");
}
