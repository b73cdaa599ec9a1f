//! Parameters free, held, bounded or known beforehand, by name: in the numerics, and as settings of a stage.

use crate::answer::has;
use crate::fixture;
use crate::identify::{GEOMETRY, model, recording};
use crate::recorded::settings;
use crate::sr210d::experiment;
use calib::estimate::{Bounds, CONFLICT, Fitted, Known, Model, ParameterStatus, Prior, align, fit};
use calib::robot::{Measurements, RobotModel};
use calib::stage::{Identify, Stage};
use calib::table::{ParameterRow, Parameters};
use serde_json::json;

/// A recording of an arm with ratio errors, and the model that is to be fitted to it.
struct Case {
    data: Measurements,
    start: Model,
    truth: Model,
}

fn case(seed: usize) -> Case {
    let description = fixture::offset_wrist();
    let effects = [&GEOMETRY[..], &["reduction_ratio"]].concat();
    let (data, truth) = recording(&description, &effects, 100, seed);
    let robot = RobotModel::new(description);
    let base = align(&robot, &data, &(0..100).collect::<Vec<_>>());
    Case {
        start: model(&robot, base, &effects),
        data,
        truth,
    }
}

impl Case {
    fn position(&self, name: &str) -> usize {
        self.start
            .stack
            .specs()
            .iter()
            .position(|spec| spec.name == name)
            .unwrap()
    }
    fn fit(&mut self, known: &[(usize, Known)], fixed: &[(usize, f64)]) -> (Vec<f64>, Fitted) {
        let rows: Vec<usize> = (0..self.data.rows()).collect();
        let count = self.start.x.len();
        let candidates: Vec<usize> = (0..count)
            .filter(|k| fixed.iter().all(|(other, _)| other != k))
            .collect();
        self.start.x = vec![0.0; count];
        for (k, value) in fixed {
            self.start.x[*k] = *value;
        }
        self.start.known = known.iter().copied().collect();
        let (model, fitted) = fit(&self.start, &self.data, &rows, &candidates);
        (model.x, fitted)
    }
}

fn between(low: f64, high: f64) -> Known {
    Known {
        bounds: Some(Bounds { low, high }),
        prior: None,
    }
}

fn about(mean: f64, sigma: f64) -> Known {
    Known {
        prior: Some(Prior { mean, sigma }),
        bounds: None,
    }
}

fn close(a: &[f64], b: &[f64], tolerance: f64) {
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < tolerance, "parameter {k}: {a:e} and {b:e}");
    }
}

#[test]
fn a_parameter_at_its_bound_leaves_the_others_as_if_it_were_held_there() {
    let mut case = case(41);
    let k = case.position("reduction_ratio.j2");
    let (free, _) = case.fit(&[], &[]);
    let bound = 0.5 * free[k];
    let known = if bound > 0.0 {
        between(-bound, bound)
    } else {
        between(bound, -bound)
    };
    let (bounded, fitted) = case.fit(&[(k, known)], &[]);
    assert_eq!(bounded[k], bound);
    let ParameterStatus::Bound(wanted) = fitted.statuses[k] else {
        panic!("{:?}", fitted.statuses[k])
    };
    assert!(
        (wanted / free[k] - 1.0).abs() < 0.05,
        "the data would have {wanted:e}, let go they give {:e}",
        free[k]
    );
    let (held, _) = case.fit(&[], &[(k, bound)]);
    // The noise is estimated by two fits: a fiftieth of it may differ.
    close(&bounded, &held, 2e-5);
}

#[test]
fn bounds_that_do_not_bite_change_nothing_and_a_start_on_a_bound_is_left() {
    let mut case = case(42);
    let k = case.position("reduction_ratio.j3");
    let (free, plain) = case.fit(&[], &[]);
    let wide: Vec<(usize, Known)> = (6..free.len()).map(|k| (k, between(-0.1, 0.1))).collect();
    let (loose, fitted) = case.fit(&wide, &[]);
    close(&free, &loose, 1e-10);
    assert_eq!(fitted.course.len(), plain.course.len());
    let known = if free[k] > 0.0 {
        between(0.0, 0.01)
    } else {
        between(-0.01, 0.0)
    };
    let (released, fitted) = case.fit(&[(k, known)], &[]);
    assert!(
        matches!(fitted.statuses[k], ParameterStatus::Free(_)),
        "{:?}",
        fitted.statuses[k]
    );
    close(&free, &released, 1e-8);
}

#[test]
fn several_bounds_at_once_end_where_no_allowed_step_lowers_the_cost() {
    let mut case = case(43);
    let (free, _) = case.fit(&[], &[]);
    let ratios: Vec<usize> = (1..=6)
        .map(|j| case.position(&format!("reduction_ratio.j{j}")))
        .collect();
    let tight: Vec<(usize, Known)> = ratios
        .iter()
        .map(|k| (*k, between(-0.3 * free[*k].abs(), 0.3 * free[*k].abs())))
        .collect();
    let (bounded, fitted) = case.fit(&tight, &[]);
    let cost = |fitted: &Fitted| {
        fitted
            .course
            .last()
            .map_or(f64::NAN, |iteration| iteration.rms)
    };
    let stopped: Vec<usize> = ratios
        .iter()
        .copied()
        .filter(|k| matches!(fitted.statuses[*k], ParameterStatus::Bound(_)))
        .collect();
    assert!(stopped.len() >= 4, "{} of 6 stopped", stopped.len());
    // Each moved inwards and held there, with the other bounds kept: worse every time.
    for k in &stopped {
        let others: Vec<(usize, Known)> = tight
            .iter()
            .copied()
            .filter(|(other, _)| other != k)
            .collect();
        let (_, inside) = case.fit(&others, &[(*k, 0.9 * bounded[*k])]);
        assert!(
            cost(&inside) >= cost(&fitted) * 0.9999,
            "{k}: {:e} and {:e}",
            cost(&inside),
            cost(&fitted)
        );
    }
}

#[test]
fn a_prior_and_the_data_meet_where_their_sigmas_say_and_the_data_alone_can_be_told_again() {
    let mut case = case(44);
    let k = case.position("reduction_ratio.j4");
    let (free, plain) = case.fit(&[], &[]);
    let ParameterStatus::Free(sigma) = plain.statuses[k] else {
        panic!("not free")
    };
    let (mean, prior_sigma) = (free[k] + 3.0 * sigma, 0.7 * sigma);
    let (both, fitted) = case.fit(&[(k, about(mean, prior_sigma))], &[]);
    let weight = |sigma: f64| sigma.powi(-2);
    let expected = (free[k] * weight(sigma) + mean * weight(prior_sigma))
        / (weight(sigma) + weight(prior_sigma));
    assert!(
        (both[k] - expected).abs() < 0.02 * sigma,
        "{:e} for {expected:e}",
        both[k]
    );
    let ParameterStatus::Free(narrow) = fitted.statuses[k] else {
        panic!("not free")
    };
    assert!((narrow / (weight(sigma) + weight(prior_sigma)).powf(-0.5) - 1.0).abs() < 0.02);
    let prior_check = fitted.prior_checks[&k];
    let (without, spread) = prior_check.without.unwrap();
    assert!((without - free[k]).abs() < 0.05 * sigma && (spread / sigma - 1.0).abs() < 0.03);
    assert!(
        (prior_check.conflict - 3.0 / f64::hypot(1.0, 0.7)).abs() < 0.05,
        "{}",
        prior_check.conflict
    );
}

#[test]
fn a_prior_against_the_data_is_called_a_conflict_and_one_that_agrees_is_not() {
    let mut case = case(45);
    let k = case.position("reduction_ratio.j5");
    let right = case.truth.x[k];
    let (_, agrees) = case.fit(&[(k, about(right, 2e-5))], &[]);
    assert!(agrees.prior_checks[&k].conflict < CONFLICT);
    let (_, contradicts) = case.fit(&[(k, about(right + 5e-4, 5e-5))], &[]);
    assert!(contradicts.prior_checks[&k].conflict > CONFLICT);
}

#[test]
fn what_only_a_prior_tells_keeps_its_mean_and_its_sigma() {
    let mut case = case(46);
    // The base may turn instead: the data cannot tell the zero of joint 1.
    let k = case.position("joint_offset.j1");
    let (_, plain) = case.fit(&[], &[]);
    let ParameterStatus::Free(wide) = plain.statuses[k] else {
        panic!("{:?}", plain.statuses[k])
    };
    let tolerance = case.start.tolerances[k];
    assert!(wide > 0.99 * tolerance, "{wide:e}");
    let (x, fitted) = case.fit(&[(k, about(2e-3, 1e-4))], &[]);
    let ParameterStatus::Free(sigma) = fitted.statuses[k] else {
        panic!("{:?}", fitted.statuses[k])
    };
    assert!((x[k] - 2e-3).abs() < 1e-8, "{:e}", x[k]);
    assert!((sigma / 1e-4 - 1.0).abs() < 1e-3);
    assert_eq!(fitted.prior_checks[&k].without, None);
}

fn row<'a>(table: &'a Parameters, name: &str) -> &'a ParameterRow {
    table.0.iter().find(|row| row.name == name).unwrap()
}

#[test]
fn settings_by_name_are_found_again_in_the_table_and_what_matches_nothing_is_said() {
    let (recorded, _) = experiment("none", 5);
    let effects = [
        "base_frame",
        "tool_offset",
        "joint_offset",
        "link_geometry",
        "reduction_ratio",
    ];
    let run = |settings: serde_json::Value| {
        let mut all = json!({"on": ["unloaded_fit"], "effects": effects});
        all.as_object_mut()
            .unwrap()
            .extend(settings.as_object().cloned().unwrap());
        let made = recorded.identify(all);
        (made.get::<Parameters>(), made.warnings)
    };
    let free = ["base_frame.*", "tool_offset.*", "reduction_ratio.*"];
    let (parameters, warnings) = run(json!({
        "free": free,
        "hold": ["reduction_ratio.j1", "reduction_ratio.k2"],
        "bounds": {"reduction_ratio.*": [-5e-4, 5e-4], "reduction_ratio.j3": [-1e-2, 1e-2]},
        "prior": {"tool_offset.x": {"sigma": 0.001, "mean": 3}},
    }));
    assert!(
        parameters
            .0
            .iter()
            .filter(|row| row.effect == "link_geometry")
            .all(|row| row.status == "held")
    );
    assert_eq!(row(&parameters, "reduction_ratio.j1").status, "held");
    let stopped = row(&parameters, "reduction_ratio.j2");
    // Under its tolerance it stays within its bound.
    assert!(["free", "bound"].contains(&stopped.status.as_str()) && stopped.value <= 5e-4);
    assert_eq!(
        row(&parameters, "reduction_ratio.j3").status,
        "free",
        "the longer pattern counts"
    );
    let answer = row(&parameters, "tool_offset.x");
    assert!((answer.value - 3.0).abs() < 0.5, "in mm: {}", answer.value);
    assert!(
        answer
            .remark
            .as_deref()
            .is_some_and(|remark| remark.contains("contradict each other")),
        "{:?}",
        answer.remark
    );
    has(
        &warnings,
        [
            "hold: `reduction_ratio.k2` matches no parameter of this model; did you mean `reduction_ratio.j2`?",
            "tool_offset.x: the prior says 3.0000 +- 0.0010 mm, the data say",
        ],
    );
}

#[test]
fn settings_that_say_nothing_or_something_impossible_are_faults_with_their_place() {
    let faults = settings::<Identify>(json!({
        "free": ["reduction_ration.j2"],
        "prior": {"joint_offset.j2": {"sigma": 0}, "base_frame.x": {"sigma": 1}},
        "bounds": {"link_geometry.*": [1, -1]},
    }))
    .check();
    assert_eq!(faults.len(), 4, "{faults:#?}");
    let faults: Vec<String> = faults.iter().map(ToString::to_string).collect();
    has(
        &faults.join("\n"),
        [
            "free: `reduction_ration.j2` names no effect; did you mean `reduction_ratio`?",
            "prior.joint_offset.j2: expected a sigma above zero",
            "prior.base_frame.x: where the robot stands",
            "bounds.link_geometry.*: expected two numbers, the lower one first",
        ],
    );
    assert_eq!(settings::<Identify>(json!({"free": []})).check().len(), 1);
    assert!(
        settings::<Identify>(json!({"free": ["*"], "hold": ["*.j6"]}))
            .check()
            .is_empty()
    );
}
