//! Recordings that are not as they should be get an answer in plain words; derivatives of what is closed are those of differences.

use super::{fixture, plane, socket, sphere, touched, truth};
use crate::answer::has;
use crate::gauges::laws::derivatives_hold;
use crate::recorded::Recorded;
use calib::description::RobotDescription;
use calib::observation::KINDS;
use calib::stage::Identify;
use calib::table::{Parameters, Recording};

pub const SETTINGS: &str = r#"
on: [fit]
effects: [anchor, base_frame, tool_offset, joint_offset, link_geometry]
prior: {"link_geometry.*": {sigma: 0.3}, "link_geometry.*.r*": {sigma: 0.001}, "joint_offset.*": {sigma: 0.03}}
distances: [{between: ["*/0", "*/1"], mm: 50, sigma: 0.05}]
"#;

pub fn cell(points: usize) -> [calib::twin::touch::Fixture; 4] {
    [
        socket("a/0", [480.0, 120.0, 300.0], points, 60.0),
        socket("a/1", [480.0, 170.0, 300.0], points, 60.0),
        socket("b/0", [-250.0, 450.0, 380.0], points, 60.0),
        socket("b/1", [-250.0, 450.0, 430.0], points, 60.0),
    ]
}

/// All that an identification says, and its parameters.
fn message_of(
    robot: &RobotDescription,
    recording: Recording,
    settings: &str,
) -> (String, Parameters) {
    let stage: Identify = serde_saphyr::from_str(settings).unwrap();
    let made = Recorded::fitted(robot, recording)
        .identify_by(&stage)
        .unwrap();
    ([&*made.warnings, &made.notes].join("\n"), made.get())
}

#[test]
fn rows_of_another_hole_are_named_with_the_hole() {
    let robot = fixture::seven();
    let mut recording = touched(&robot, &truth(&robot, 3), &cell(25), 3);
    let names = recording.names.get_mut("socket").unwrap();
    for row in [30, 31] {
        names[row] = Some("b/0".into());
    }
    let (text, parameters) = message_of(&robot, recording, SETTINGS);
    let closing = "2 rows do not close within their noise";
    has(
        &text,
        [closing, "a/1-0006 to a/1-0007 (2 rows)", "where `a/1` is"],
    );
    let known = "the scale of the arm is known to";
    has(&text, [known, "by the lengths that were given"]);
    // Priors are visible in the table.
    let links = parameters.0.iter();
    let links = links.filter(|row| row.name.starts_with("link_geometry") && row.status == "free");
    links.for_each(|row| has(row.remark.as_deref().unwrap_or(""), "prior"));
}

#[test]
fn a_ball_that_was_put_back_elsewhere_is_said_with_the_row() {
    let robot = fixture::seven();
    let before = truth(&robot, 4);
    let mut after = before.clone();
    after.links.last_mut().unwrap().shift_mm[0] += 1.5;
    let (first, second) = (
        touched(&robot, &before, &cell(20), 4),
        touched(&robot, &after, &cell(20), 5),
    );
    let mut recording = first.clone();
    let half = 40 * first.joints;
    recording.q[half..].copy_from_slice(&second.q[half..]);
    let (text, _) = message_of(&robot, recording, SETTINGS);
    has(
        &text,
        ["on the ball sits elsewhere on the tool", "from b/0-000"],
    );
    let (clean, _) = message_of(&robot, first, SETTINGS);
    assert!(
        !clean.contains("sits elsewhere") && !clean.contains("do not close"),
        "{clean}"
    );
}

#[test]
fn five_rows_and_no_length_are_said_to_be_too_little() {
    let robot = fixture::seven();
    let recording = touched(
        &robot,
        &truth(&robot, 5),
        &[socket("a/0", [480.0, 120.0, 300.0], 5, 60.0)],
        5,
    );
    let bare = "{effects: [anchor, base_frame, tool_offset, joint_offset, link_geometry]}";
    let (text, _) = message_of(&robot, recording, bare);
    has(&text, "only 5 points for");
    has(
        &text,
        "the scale of the arm is not observable: no length was given",
    );
}

#[test]
fn names_that_the_recording_does_not_have_are_refused() {
    let robot = fixture::seven();
    let recording = touched(
        &robot,
        &truth(&robot, 5),
        &[socket("a/0", [480.0, 120.0, 300.0], 9, 60.0)],
        5,
    );
    let recorded = Recorded::fitted(&robot, recording);
    for (more, expected) in [
        (
            "distances: [{between: [a/0, a/7], mm: 50, sigma: 0.1}]",
            "no `a/0` and `a/7`; the recording has: a/0",
        ),
        (
            "spheres: {ball: {diameter: 30, sigma: 0.1}}",
            "no sphere `ball`; the recording has: a/0",
        ),
    ] {
        let stage: Identify = serde_saphyr::from_str(more).unwrap();
        let message = recorded.identify_by(&stage).err().unwrap().to_string();
        has(&message, expected);
    }
}

#[test]
fn derivatives_of_sockets_planes_and_spheres_are_central_differences() {
    let things = [
        socket("a", [480.0, 120.0, 300.0], 4, 0.0),
        plane("table", [100.0, -480.0, 320.0], [0.2, 0.1, 1.0], 4, 0.0),
        sphere("ball", [350.0, -350.0, 450.0], 40.0, 5, 0.0),
    ];
    for robot in [fixture::offset_wrist(), fixture::seven()] {
        let data = touched(&robot, &truth(&robot, 2), &things, 2).measurements();
        let (mut model, _) = super::calibrated(&robot, &data, &[], &[]);
        for (k, value) in model.x.iter_mut().enumerate() {
            *value += 2e-3 * (1.3 * k as f64).sin();
        }
        let contacts = KINDS.iter().filter(|kind| kind.is_contact());
        let rows = contacts.flat_map(|kind| (0..data.rows()).map(move |row| (*kind, row)));
        let checked = rows.filter(|(kind, row)| derivatives_hold(*kind, &model, &data, *row));
        assert_eq!(checked.count(), 13);
    }
}
