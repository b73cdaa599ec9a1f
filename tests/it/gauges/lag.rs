//! Joints that are logged before the arm has settled, with several targets a pose: the lag is that of the move to the pose.

use super::laws::select;
use super::{Cell, THREE};
use crate::answer::has;
use crate::fixture::{self, diagnosed};
use crate::identify::normal;
use calib::diagnose::Diagnosis;
use calib::robot::{Measurements, Named, Sequence};

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// Poses with all three targets, 20 s apart; every joint has `rest` of what it last moved to go, as a share of the largest move or in all.
fn lagging(poses: usize, others: impl Fn(f64, f64) -> f64) -> (Cell, Measurements) {
    let cell = Cell::new(fixture::offset_wrist(), &THREE, 17);
    let mut data = cell.rows(poses, 0);
    let (logged, joints) = (data.q.clone(), data.joints);
    for pose in 1..poses {
        let moves: Vec<f64> = (0..joints)
            .map(|joint| {
                logged[3 * pose * joints + joint] - logged[3 * (pose - 1) * joints + joint]
            })
            .collect();
        let largest = moves.iter().map(|moved| moved.abs()).fold(0.0, f64::max);
        for row in 3 * pose..3 * (pose + 1) {
            (0..joints)
                .for_each(|joint| data.q[row * joints + joint] += others(moves[joint], largest));
        }
    }
    data.points.position = cell.truth.predict(&data);
    data.q = logged;
    // Encoders of a halted arm show other last digits every time.
    data.q
        .iter_mut()
        .enumerate()
        .for_each(|(k, q)| *q += 2e-6 * normal(7_000_000 + k));
    data.time = Some((0..data.rows()).map(|row| 20.0 * row as f64).collect());
    cell.disturb(&mut data);
    (cell, data)
}

fn lag_alone(diagnosis: &Diagnosis, what: &str) -> (String, f64) {
    let findings = &diagnosis.findings;
    let named: Vec<&str> = findings.iter().map(|finding| &*finding.effect).collect();
    assert_eq!(named, ["joint_log_lag"], "{what}: {}", diagnosis.statement);
    let found = &findings[0];
    (found.statement.clone(), found.parameters[0].value)
}

#[test]
fn a_lag_of_the_last_move_is_found_with_three_targets_a_pose() {
    let (cell, data) = lagging(60, |moved, _| 0.002 * moved);
    let (statement, share) = lag_alone(&diagnosed(&cell.description, &data), "in order");
    assert!((share / 0.002 - 1.0).abs() < 0.05, "{statement}");
    has(&statement, "of the last move was still to come");
}

#[test]
fn a_lag_of_a_synchronous_motion_is_shared_out_as_the_moves_are() {
    let (cell, data) = lagging(60, |moved, largest| 90.0 * ARCSEC * moved / largest);
    let (statement, remaining) = lag_alone(&diagnosed(&cell.description, &data), "in order");
    assert!((remaining / 90.0 - 1.0).abs() < 0.05, "{statement}");
    has(
        &statement,
        "the joint that moved most had 90.3 arcsec still to come",
    );
}

/// One target after the other, and rows by name in no order at all: the way to a pose is that of time.
#[test]
fn rows_in_another_order_than_their_times_lag_by_their_times() {
    let (cell, data) = lagging(60, |moved, largest| 90.0 * ARCSEC * moved / largest);
    let by_target: Vec<usize> = (0..3)
        .flat_map(|target| (0..60).map(move |pose| 3 * pose + target))
        .collect();
    let by_name: Vec<usize> = (0..180).map(|k| (k * 77) % 180).collect();
    for (what, order) in [("by target", by_target), ("by name", by_name)] {
        let mut sorted = select(&data, &order);
        sorted.target = Some(Named::of(order.iter().map(|row| data.target(*row))));
        sorted.time = data
            .time
            .as_ref()
            .map(|time| order.iter().map(|row| time[*row]).collect());
        let times = sorted.time.clone().unwrap();
        sorted.sequence = Sequence::by_time(&times, |a, b| sorted.near_pose(a, b));
        let way = |data: &Measurements, row, joint| {
            (data.last_move(row, joint), data.direction(row, joint))
        };
        for (row, ours) in order.iter().enumerate() {
            for joint in 0..data.joints {
                let (there, here) = (way(&sorted, row, joint), way(&data, *ours, joint));
                assert_eq!(there, here, "{what}, row {row}, joint {joint}");
            }
        }
        let (statement, remaining) = lag_alone(&diagnosed(&cell.description, &sorted), what);
        assert!((remaining / 90.0 - 1.0).abs() < 0.05, "{what}: {statement}");
    }
}
