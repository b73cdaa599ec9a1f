//! Poses measured more than once: the joints' repeatability, the floor, lack of fit, and sigmas that allow for shared errors.

use crate::answer::has;
use crate::fixture::{self, all_rows, fit_all, question};
use crate::identify::{GEOMETRY, SIGMA, model, normal, recording};
use crate::sr210d::experiment;
use calib::diagnose::{Diagnosis, diagnose};
use calib::estimate::{Fitted, Model, ParameterStatus, Poses, align, spread};
use calib::robot::{Measurements, NoiseBasis, PointReadings, RobotModel};
use calib::stage::{Identify, Stage};
use nalgebra::Vector3;
use serde_json::json;

const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// A recording of `poses` poses with so many visits of so many rows; at each visit every joint misses by `joint_sigma`.
fn visited(
    poses: usize,
    visits: usize,
    rows: usize,
    joint_sigma: f64,
    seed: usize,
) -> (Measurements, Model) {
    let description = fixture::offset_wrist();
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let (once, truth) = recording(&description, &effects, poses, seed);
    let count = poses * visits * rows;
    let mut data = Measurements {
        joints: once.joints,
        points: PointReadings::new(vec![Vector3::zeros(); count], SIGMA),
        payload: vec![0.0; count],
        ..Measurements::default()
    };
    let mut real = Vec::new();
    // All poses, then all again.
    for row in 0..count {
        let visit = row / rows;
        data.q.extend(once.q(visit % poses));
        let missed = (0..once.joints)
            .map(|joint| joint_sigma * normal(seed * 1_000_003 + visit * once.joints + joint));
        real.extend(
            once.q(visit % poses)
                .iter()
                .zip(missed)
                .map(|(q, missed)| q + missed),
        );
    }
    let commanded = std::mem::replace(&mut data.q, real);
    data.points.position = truth.predict(&data);
    data.q = commanded;
    for (row, point) in data.points.position.iter_mut().enumerate() {
        *point += Vector3::from_fn(|axis, _| {
            SIGMA * normal(77_777_777 + seed * 900_001 + 3 * row + axis)
        });
    }
    (data, truth)
}

fn start(data: &Measurements, effects: &[&str]) -> Model {
    let robot = RobotModel::new(fixture::offset_wrist());
    let base = align(&robot, data, &all_rows(data));
    model(&robot, base, effects)
}

fn identify(data: &Measurements, effects: &[&str]) -> (Model, Fitted) {
    fit_all(&start(data, effects), data, &all_rows(data))
}

fn repeatability(data: &Measurements) -> Option<f64> {
    let model = start(data, &["base_frame"]);
    Poses::of(data, &all_rows(data)).joint_repeatability(&model, data)
}

#[test]
fn joint_repeatability_comes_back_from_returns_and_is_not_seen_where_there_is_none() {
    let (data, _) = visited(60, 4, 2, 5.0 * ARCSEC, 1);
    let poses = Poses::of(&data, &all_rows(&data));
    assert_eq!((poses.all().len(), poses.repeated().count()), (60, 60));
    // Two exchanged returns do not spoil it.
    let (mut exchanged, _) = visited(60, 4, 1, 5.0 * ARCSEC, 3);
    exchanged.points.position.swap(60, 61);
    for data in [data, exchanged] {
        let found = repeatability(&data).unwrap() / (5.0 * ARCSEC);
        assert!((found - 1.0).abs() < 0.12, "{found:.3} of the truth");
    }
    for seed in 2..6 {
        assert_eq!(repeatability(&visited(60, 4, 1, 0.0, seed).0), None);
    }
    // The arm never moves between the rows of a pose: nothing can be said.
    assert_eq!(repeatability(&visited(60, 1, 4, 5.0 * ARCSEC, 1).0), None);
}

#[test]
fn lack_of_fit_tells_a_complete_model_from_one_without_ratios() {
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let mut chances = Vec::new();
    for seed in 10..30 {
        let (data, _) = visited(40, 2, 1, 0.0, seed);
        let repeated = identify(&data, &effects).1.repeated.unwrap();
        assert_eq!(
            (repeated.poses, repeated.freedom, repeated.revisited),
            (40, 120, true)
        );
        assert!(
            (repeated.noise / SIGMA - 1.0).abs() < 0.25,
            "{:e}",
            repeated.noise
        );
        chances.push(repeated.lack_of_fit.unwrap().1);
    }
    // Uniform under a complete model.
    let below = chances.iter().filter(|chance| **chance < 0.5).count();
    assert!(
        (4..=16).contains(&below) && chances.iter().all(|chance| *chance > 1e-3),
        "{chances:?}"
    );
    let (data, _) = visited(40, 2, 1, 0.0, 10);
    let (ratio, chance) = identify(&data, &GEOMETRY)
        .1
        .repeated
        .and_then(|repeated| repeated.lack_of_fit)
        .unwrap();
    assert!(ratio > 10.0 && chance < 1e-9, "F {ratio}, p {chance:e}");
}

/// What a diagnosis of all rows says, with standard deviations of points stated so many times too large.
fn diagnosed(data: &Measurements, stated: f64) -> Diagnosis {
    let robot = RobotModel::new(fixture::offset_wrist());
    let mut data = data.clone();
    data.points
        .sigma
        .iter_mut()
        .for_each(|sigma| *sigma *= stated);
    let fit = all_rows(&data);
    diagnose(&question(&robot, &data, &fit), |_| ())
}

#[test]
fn shots_of_a_standing_arm_show_the_noise_however_it_is_stated() {
    let (data, _) = visited(60, 1, 3, 0.0, 21);
    for stated in [6.0, 1.0, 1.0 / 6.0] {
        let found = diagnosed(&data, stated);
        let floor = found.noise_floor / (SIGMA * f64::sqrt(3.0));
        assert!(
            (floor - 1.0).abs() < 0.12,
            "stated {stated:.2} times: {floor:.3} of the noise"
        );
        assert_eq!(
            (found.noise_basis, found.repeatability.repeats),
            (NoiseBasis::Repeats, 120)
        );
    }
}

#[test]
fn returns_add_the_joints_to_the_noise_that_shots_show() {
    let (data, _) = visited(40, 3, 3, 5.0 * ARCSEC, 22);
    let found = diagnosed(&data, 6.0);
    let joints = found.repeatability.sigma / (5.0 * ARCSEC);
    assert!(
        (joints - 1.0).abs() < 0.15 && found.noise_floor > 2.0 * SIGMA,
        "{joints:.3}, {:e}",
        found.noise_floor
    );
    assert_eq!(found.noise_basis, NoiseBasis::Repeats);
}

#[test]
fn what_a_model_leaves_at_a_pose_is_no_correlated_noise_for_being_measured_three_times() {
    let (mut data, _) = visited(80, 1, 3, 0.0, 23);
    for (row, point) in data.points.position.iter_mut().enumerate() {
        *point +=
            Vector3::from_fn(|axis, _| 4.0 * SIGMA * normal(5_000_011 + 3 * (row / 3) + axis));
    }
    let found = diagnosed(&data, 1.0);
    let printed = found.not_observable.join("; ");
    let names: Vec<&str> = found
        .findings
        .iter()
        .map(|finding| finding.statement.as_str())
        .collect();
    assert!(!printed.contains("correlated"), "{names:?} {printed}");
}

/// Scatter over reported sigma of the ratios of so many robots, and their mean sigma.
fn scatter(robots: usize, rows: usize, know: bool) -> (f64, f64) {
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let (mut squares, mut count, mut sigmas) = (0.0, 0.0, 0.0);
    for seed in 100..100 + robots {
        let (mut data, truth) = visited(60, 1, rows, 8.0 * ARCSEC, seed);
        if know {
            data.spread = Some(spread(&start(&data, &["base_frame"]), &data, 8.0 * ARCSEC));
        }
        let (model, fitted) = identify(&data, &effects);
        assert_eq!(fitted.clusters, if rows > 1 { 60 } else { 0 });
        for (k, spec) in model.stack.specs().iter().enumerate() {
            if let (true, ParameterStatus::Free(sigma)) = (
                spec.name.starts_with("reduction_ratio"),
                &fitted.statuses[k],
            ) {
                squares += ((model.x[k] - truth.x[k]) / sigma).powi(2);
                sigmas += sigma;
                count += 1.0;
            }
        }
    }
    (f64::sqrt(squares / count), sigmas / count)
}

#[test]
fn sigmas_allow_for_what_the_rows_of_a_pose_share_and_known_repeatability_weighs_rows_better() {
    let (repeated, wide) = scatter(40, 4, false);
    let (informed, narrow) = scatter(40, 1, true);
    for scatter in [repeated, informed] {
        assert!(
            (0.85..1.18).contains(&scatter),
            "scatter over reported sigma {scatter:.3}"
        );
    }
    // Four rows at rest say hardly more than one where joints err more than the tracker.
    let (_, once) = scatter(40, 1, false);
    assert!(
        (0.8..1.05).contains(&(wide / once)) && narrow < once,
        "four rows {wide:e}, one row {once:e}, informed {narrow:e}"
    );
}

#[test]
fn the_stage_weighs_by_the_stated_repeatability_and_tables_what_repeats_say() {
    let (recorded, _) = experiment("none", 5);
    let mut settings = json!({"on": ["unloaded_fit"], "effects": ["base_frame", "tool_offset"], "repeatability": {"arcsec": 4.0}});
    let stated = recorded.identify(settings.clone());
    let sigma = stated.quantity("joint_repeatability_rad").unwrap();
    assert!((sigma / (4.0 * ARCSEC) - 1.0).abs() < 1e-9);
    assert_eq!(stated.quantity("repeated_poses"), None);
    // Every second of the first hundred rows takes the joints of the one before: fifty poses at rest.
    let mut recorded = recorded;
    let recording = &mut recorded.recording;
    for row in (1..50).step_by(2) {
        let joints = recording.q(row - 1).to_vec();
        recording.q[row * recording.joints..(row + 1) * recording.joints].copy_from_slice(&joints);
        recording.position[row] = recording.position[row - 1].map(|value| value + 3e-6);
    }
    settings["repeatability"] = json!("measured");
    let made = recorded.identify(settings);
    assert_eq!(made.quantity("repeated_poses"), Some(25.0));
    assert_eq!(made.quantity("clusters"), Some(25.0));
    assert!(made.quantity("repeat_noise_mm").unwrap() < 0.01);
    assert!(made.quantity("lack_of_fit_p").unwrap() < 1e-6);
    let expected = [
        "measured more than once: 25 poses",
        "this model lacks something",
    ];
    has(&made.notes, expected);
    let wrong: Identify =
        serde_json::from_value(json!({"repeatability": {"arcsec": 0.0}})).unwrap();
    assert!(wrong.check().iter().any(|fault| {
        fault
            .to_string()
            .starts_with("repeatability: expected `measured`")
    }));
}
