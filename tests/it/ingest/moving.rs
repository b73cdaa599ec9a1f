//! Arms that move while they are measured: velocities as the file has them, or by the joints over time, and two clocks in one recording.

use super::{refusal, rr, settings, take};
use crate::answer::has;
use crate::desk::Desk;
use calib::stage::Stage;
use std::fmt::Write;

/// Joints (rad) and their velocities (rad/s) at a time.
fn joint(number: usize, time: f64) -> (f64, f64) {
    let pace = 2.0 + number as f64;
    (0.4 * (pace * time).sin(), 0.4 * pace * (pace * time).cos())
}

fn controller(step: f64, rows: usize, left_out: impl Fn(usize) -> bool) -> String {
    let mut text = "t,q1,q2,dq1,dq2,x,y,z\n".to_string();
    for row in (0..rows).filter(|row| !left_out(*row)) {
        let time = step * row as f64;
        let [(a, da), (b, db)] = [joint(0, time), joint(1, time)];
        let [a, b, da, db] = [a, b, da, db].map(f64::to_degrees);
        writeln!(text, "{time:.4},{a:.7},{b:.7},{da:.6},{db:.6},1,2,3").unwrap();
    }
    text
}

const POINT: &str = "      x: {column: x, unit: mm}\n      y: {column: y, unit: mm}\n      z: {column: z, unit: mm}\n";

fn one_file(more: &str) -> String {
    format!(
        "files:\n  - file: a.csv\n    columns:\n      time: {{column: t, unit: s}}\n      q: {{column: \"q{{j}}\", unit: deg}}\n{POINT}{more}"
    )
}

#[test]
fn velocities_arrive_in_the_unit_that_the_settings_say() {
    let yaml = one_file("      velocity: {column: \"dq{j}\", unit: deg/s}\n");
    let taken = take(
        &Desk::default().with("a.csv", controller(0.01, 50, |_| false)),
        &yaml,
        rr(),
    )
    .unwrap();
    let velocity = taken.recording.velocity.unwrap();
    for row in 0..50 {
        for number in 0..2 {
            assert!((velocity[2 * row + number] - joint(number, 0.01 * row as f64).1).abs() < 1e-7);
        }
    }
    let wrong = yaml.replace("deg/s", "deg");
    let faults = settings(&wrong).check();
    assert!(
        faults
            .iter()
            .any(|fault| fault.message.contains("allowed: rad/s, deg/s")),
        "{faults:?}"
    );
}

#[test]
fn velocities_follow_from_the_joints_over_time_but_never_across_gaps() {
    let yaml = one_file("motion: {}\n");
    // Rows 20 to 39 are missing; row 45 stands alone between two gaps of ten steps.
    let left_out = |row: usize| (20..40).contains(&row) && row != 30;
    let desk = Desk::default().with("a.csv", controller(0.01, 80, left_out));
    let taken = take(&desk, &yaml, rr()).unwrap();
    let (time, velocity) = (
        taken.recording.time.unwrap(),
        taken.recording.velocity.unwrap(),
    );
    for (row, time) in time.iter().enumerate() {
        for number in 0..2 {
            let (found, expected) = (velocity[2 * row + number], joint(number, *time).1);
            if (time - 0.3).abs() < 1e-9 {
                assert!(found.is_nan(), "nothing is known of a row between two gaps");
            } else {
                // h2/6 of the third derivative in the middle, twice that at the ends of a stretch: 4e-4 of 1.2 rad/s.
                assert!(
                    (found - expected).abs() < 5e-4,
                    "{time}: {found} against {expected}"
                );
            }
        }
    }
    let printed = desk.notes.lock().unwrap().join("\n");
    has(
        &printed,
        [
            "10.0 ms apart, never across gaps above 50 ms",
            "none for 1 row between gaps",
        ],
    );
}

#[test]
fn standing_points_are_refused_where_velocities_are_asked_for() {
    let yaml = one_file("motion: {}\n");
    let desk = Desk::default().with("a.csv", controller(1.6, 60, |_| false));
    let text = refusal(&desk, &yaml, rr());
    has(&text, ["1600.0 ms apart, too far", "leave `motion` out"]);
    let faults = settings(&yaml.replace("      time: {column: t, unit: s}\n", "")).check();
    assert!(
        faults.iter().any(|fault| fault.place == "motion"),
        "{faults:?}"
    );
}

#[test]
fn velocities_in_another_unit_than_the_settings_say_are_refused() {
    let yaml = one_file("      velocity: {column: \"dq{j}\", unit: rad/s}\nmotion: {}\n");
    let desk = Desk::default().with("a.csv", controller(0.01, 50, |_| false));
    let text = refusal(&desk, &yaml, rr());
    has(
        &text,
        [
            "the velocities of joint 1 are 57.",
            "state the unit and sign",
        ],
    );
    let yaml = yaml.replace("rad/s", "deg/s");
    assert!(
        take(
            &Desk::default().with("a.csv", controller(0.01, 50, |_| false)),
            &yaml,
            rr()
        )
        .is_ok()
    );
}

/// A controller at 250 Hz and a tracker at 60 Hz whose clock is 1 s ahead: without carrying, joints are up to 2 ms from their point.
#[test]
fn two_clocks_become_one_recording_with_the_joints_at_the_moment_of_the_point() {
    let mut tracker = "stamp,x,y,z\n".to_string();
    for row in 0..100 {
        writeln!(tracker, "{:.6},1,2,3", 1.0 + 0.0033 + row as f64 / 60.0).unwrap();
    }
    let controller_columns =
        "      time: {column: t, unit: s}\n      q: {column: \"q{j}\", unit: deg}\n";
    let tracker_columns = format!("      time: {{column: stamp, unit: s}}\n{POINT}");
    let files = |tracker_first: bool, velocity: &str| {
        let a = format!("  - file: a.csv\n    columns:\n{controller_columns}{velocity}");
        let b = format!("  - file: b.csv\n    columns:\n{tracker_columns}");
        let (first, second, offset) = if tracker_first {
            (b, a, -1.0)
        } else {
            (a, b, 1.0)
        };
        format!(
            "files:\n{first}{second}join: {{by: time, tolerance_s: 0.0021, offset_s: {offset}}}\nmax_rejected_fraction: 0.9\n"
        )
    };
    for (tracker_first, velocity, motion) in [
        (false, "", "motion: {}\n"),
        (true, "", "motion: {}\n"),
        (
            false,
            "      velocity: {column: \"dq{j}\", unit: deg/s}\n",
            "",
        ),
    ] {
        let desk = Desk::default()
            .with("a.csv", controller(0.004, 430, |_| false))
            .with("b.csv", tracker.as_str());
        let taken = take(
            &desk,
            &format!("{}{motion}", files(tracker_first, velocity)),
            rr(),
        )
        .unwrap();
        assert_eq!(taken.recording.rows(), 100);
        for row in 0..100 {
            let moment = 0.0033 + row as f64 / 60.0;
            for number in 0..2 {
                let (q, velocity) = joint(number, moment);
                let found = taken.recording.q(row)[number];
                assert!(
                    (found - q).abs() < 1e-6,
                    "{tracker_first}: {found} against {q}"
                );
                assert!(
                    (taken.recording.velocity.as_ref().unwrap()[2 * row + number] - velocity).abs()
                        < 2e-3
                );
            }
        }
        let printed = desk.notes.lock().unwrap().join("\n");
        has(
            &printed,
            "extrapolated by their velocity to the time of their point",
        );
    }
}

#[test]
fn points_that_are_known_to_be_late_take_their_joints_with_them() {
    let yaml = one_file("motion: {later_s: 0.002}\n");
    let taken = take(
        &Desk::default().with("a.csv", controller(0.01, 50, |_| false)),
        &yaml,
        rr(),
    )
    .unwrap();
    for row in 0..50 {
        let expected = joint(1, 0.01 * row as f64 + 0.002).0;
        assert!(
            (taken.recording.q(row)[1] - expected).abs() < 2e-6,
            "row {row}"
        );
    }
}
