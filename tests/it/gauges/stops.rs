//! Several targets in a pose: a repeat is the same target again, and folds, screening and the way there go by pose.

use super::laws::select;
use super::{Cell, SIGMA, THREE};
use crate::answer::has;
use crate::fixture::{self, all_rows, diagnosed, question, rms};
use crate::identify::{GEOMETRY, model, normal};
use calib::diagnose::diagnose;
use calib::estimate::{Poses, Session, SuspectKind, cross_validate, fit_screened, gauge};
use calib::robot::{Measurements, Named, NoiseBasis, RobotModel};
use nalgebra::Vector3;
use std::collections::BTreeMap;

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// Every pose measured so many times in a row with all three targets; the joints miss it by `joint_sigma` (rad) anew each time, and
/// logs differ from target to target by `jitter` (rad), as encoders of a halted arm do.
fn stops(poses: usize, visits: usize, joint_sigma: f64, jitter: f64) -> (Cell, Measurements) {
    let cell = Cell::new(fixture::offset_wrist(), &THREE, 11);
    let once = cell.rows(poses, 0);
    let order: Vec<usize> = (0..poses * visits * 3)
        .map(|row| row / (3 * visits) * 3 + row % 3)
        .collect();
    let mut data = select(&once, &order);
    data.target = Some(Named::of(order.iter().map(|row| once.target(*row))));
    let joints = data.joints;
    let commanded = data.q.clone();
    for (k, q) in data.q.iter_mut().enumerate() {
        *q += joint_sigma * normal(5_000_000 + k / (3 * joints) * joints + k % joints);
    }
    data.points.position = cell.truth.predict(&data);
    data.q = commanded;
    for (k, q) in data.q.iter_mut().enumerate() {
        *q += jitter * normal(9_000_000 + k);
    }
    cell.disturb(&mut data);
    (cell, data)
}

#[test]
fn targets_of_one_pose_are_no_repeats_of_each_other() {
    let (_, data) = stops(40, 1, 0.0, 2e-6);
    let poses = Poses::of(&data, &all_rows(&data));
    assert_eq!((poses.all().len(), poses.repeated().count()), (40, 0));
    assert!(poses.all().iter().all(|rows| rows.len() == 3));
    let (_, twice) = stops(40, 2, 0.0, 2e-6);
    let poses = Poses::of(&twice, &all_rows(&twice));
    assert_eq!((poses.all().len(), poses.repeated().count()), (40, 120));
    let same = |rows: &Vec<usize>| {
        rows.iter()
            .all(|row| twice.target(*row) == twice.target(rows[0]))
    };
    assert!(poses.repeated().all(same));
}

#[test]
fn a_diagnosis_learns_the_repeatability_from_the_same_target_again() {
    let (cell, data) = stops(40, 2, 6.0 * ARCSEC, 0.0);
    let found = diagnosed(&cell.description, &data);
    assert_eq!(
        (found.repeatability.repeats, found.noise_basis),
        (120, NoiseBasis::Repeats)
    );
    let ratio = found.repeatability.sigma / (6.0 * ARCSEC);
    assert!((0.8..1.25).contains(&ratio), "{ratio} of the truth");
    has(&found.statement, "the noise that 120 repeats show");
}

#[test]
fn the_way_to_a_pose_is_that_of_all_its_targets() {
    let (_, data) = stops(20, 2, 0.0, 3e-6);
    for row in 6..data.rows() {
        assert_eq!(data.stop(row), row / 3 * 3, "row {row}");
        // All targets twice before the arm leaves: the move is that to the pose.
        let first = row / 6 * 6;
        for joint in 0..data.joints {
            let moved = data.q(first)[joint] - data.q(first - 1)[joint];
            assert_eq!(
                data.last_move(row, joint),
                moved,
                "row {row}, joint {joint}"
            );
            assert_eq!(
                data.direction(row, joint),
                moved.signum(),
                "row {row}, joint {joint}"
            );
        }
    }
    let alone = Measurements {
        target: None,
        ..data.clone()
    };
    assert!((6..alone.rows()).all(|row| alone.last_move(row, 0) == data.last_move(row, 0)));
}

#[test]
fn folds_never_part_the_targets_of_a_pose() {
    let folds = |jitter: f64| {
        let (cell, data) = stops(60, 1, 20.0 * ARCSEC, jitter);
        let (model, fitted) = cell.fit(&data, |_| BTreeMap::new());
        let fit_rows = all_rows(&data);
        let session = Session {
            data: &data,
            rows: &fit_rows,
            model: &model,
            fitted: &fitted,
        };
        let folds = cross_validate(&session, 5, 3).unwrap();
        [rms(folds.random), rms(folds.blocks)]
    };
    // Rows of a pose share what its joints missed: seen beside the row, it would be predicted better. Logs that differ in the last
    // digits part none.
    let (plain, jittered) = (folds(0.0), folds(2e-6));
    for (plain, jittered) in plain.into_iter().zip(jittered) {
        assert!(
            (jittered / plain - 1.0).abs() < 0.02,
            "{jittered:e} and {plain:e}"
        );
    }
}

#[test]
fn a_pose_with_wrong_joints_is_set_aside_with_all_its_targets_and_no_event() {
    let (cell, mut data) = stops(60, 1, 0.0, 0.0);
    let wrong = 3 * 25..3 * 26;
    for row in wrong.clone() {
        data.q[row * data.joints + 1] += 0.01;
    }
    // Something that lasts for four poses is an event.
    for row in 3 * 40..3 * 44 {
        data.points.position[row] += Vector3::new(0.0, 3e-4, 1e-4);
    }
    let all = all_rows(&data);
    let (robot, base) = gauge(
        RobotModel::new(cell.description.clone()),
        &data,
        &all,
        &BTreeMap::new(),
    )
    .unwrap();
    let model = model(&robot, base, &GEOMETRY);
    let candidates: Vec<usize> = (0..model.x.len()).collect();
    let set = vec![0; all.len()];
    let (_, _, screening) = fit_screened(&model, &data, &all, &candidates, Some(&set));
    let of_kind = |kind: SuspectKind| -> Vec<usize> {
        screening
            .suspects
            .iter()
            .filter(|suspect| suspect.kind == kind)
            .map(|suspect| suspect.row)
            .collect()
    };
    assert_eq!(
        of_kind(SuspectKind::Outlier),
        wrong.collect::<Vec<_>>(),
        "{:?}",
        screening.suspects
    );
    assert_eq!(
        of_kind(SuspectKind::Event),
        (3 * 40..3 * 44).collect::<Vec<_>>()
    );
    assert_eq!(screening.kept.len(), all.len() - 3);
}

/// Returns within 0.03 deg of the first visit, in another order: the known motion apart they show the joints' repeatability.
#[test]
fn near_repeats_count_less_the_known_motion() {
    let cell = Cell::new(fixture::offset_wrist(), &[("", [0.0; 3])], 12);
    let once = cell.rows(60, 0);
    let returns = |near: f64, joint_sigma: f64| {
        let order: Vec<usize> = (0..60).chain((0..60).map(|k| (k * 7) % 60)).collect();
        let mut data = select(&once, &order);
        data.target = None;
        for (k, q) in data.q.iter_mut().enumerate() {
            *q += near * (normal(3_000_000 + k) / 6.0).clamp(-0.5, 0.5);
        }
        let logged = data.q.clone();
        for (k, q) in data.q.iter_mut().enumerate() {
            *q += joint_sigma * normal(4_000_000 + k);
        }
        data.points.position = cell.truth.predict(&data);
        data.q = logged;
        cell.disturb(&mut data);
        data
    };
    // At half a metre 0.03 deg are 260 um, far more than 5 arcsec and the instrument make.
    let data = returns(5e-4, 5.0 * ARCSEC);
    let poses = Poses::of(&data, &all_rows(&data));
    assert_eq!((poses.all().len(), poses.repeated().count()), (60, 60));
    let (model, fitted) = cell.fit(&data, |_| BTreeMap::new());
    let found = poses.joint_repeatability(&model, &data).unwrap() / (5.0 * ARCSEC);
    assert!((0.8..1.2).contains(&found), "{found} of the truth");
    let repeated = fitted.repeated.unwrap();
    assert_eq!(
        (repeated.poses, repeated.freedom, repeated.revisited),
        (60, 180, true)
    );
    let still = returns(5e-4, 0.0);
    let (model, fitted) = cell.fit(&still, |_| BTreeMap::new());
    let noise = fitted.repeated.unwrap().noise;
    assert!((noise / SIGMA - 1.0).abs() < 0.15, "{noise:e} m");
    assert_eq!(
        Poses::of(&still, &all_rows(&still)).joint_repeatability(&model, &still),
        None
    );
    let (robot, fit) = (RobotModel::new(cell.description.clone()), all_rows(&data));
    let diagnosis = diagnose(&question(&robot, &data, &fit), |_| ());
    assert!(
        diagnosis.repeatability.repeats >= 30 && diagnosis.noise_basis == NoiseBasis::Repeats,
        "{:?}",
        diagnosis.repeatability
    );
    let ratio = diagnosis.repeatability.sigma / (5.0 * ARCSEC);
    assert!((0.75..1.3).contains(&ratio), "{ratio} of the truth");
}
