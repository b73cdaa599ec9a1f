//! Friction of a joint over its velocity, with its band.

use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::types::FrictionCurve;
use crate::effect::Place;

/// Velocities on either side of zero.
const POINTS: usize = 30;

/// Of every joint whose set has friction.
pub(super) fn friction_curves(problem: &TorqueProblem, set: &[usize], sweep: &SweptColumns) -> Vec<FrictionCurve> {
    (0..problem.joints()).filter_map(|joint| curve(problem, set, sweep, joint)).collect()
}

fn curve(problem: &TorqueProblem, set: &[usize], sweep: &SweptColumns, joint: usize) -> Option<FrictionCurve> {
    let scene = &problem.scene;
    let forms = set.iter().map(|number| (*number, &problem.all.forms[*number]));
    let own: Vec<_> =
        forms.filter(|(_, form)| form.place == Place::Joint(joint) && form.cause.friction(form, 0.0, 0.0).is_some()).collect();
    let columns: Vec<usize> = own.iter().flat_map(|(number, _)| problem.all.of(*number)).collect();
    if columns.is_empty() {
        return None;
    }
    let covariance = sweep.covariance(&columns);
    let solution = sweep.solution();
    let value = |column: &usize| solution.iter().find(|(pivot, _)| pivot == column).map_or(0.0, |(_, value)| *value);
    let values: Vec<f64> = columns.iter().map(value).collect();
    let fastest = scene.velocity[joint].iter().map(|velocity| velocity.abs()).fold(0.0, f64::max);
    let points = (-(POINTS as i32)..=POINTS as i32).map(|point| fastest * f64::from(point) / POINTS as f64);
    let mut curve = FrictionCurve { joint, velocity: points.collect(), torque: Vec::new(), sigma: Vec::new() };
    for velocity in &curve.velocity {
        let laws: Vec<f64> =
            own.iter().filter_map(|(_, form)| form.cause.friction(form, *velocity, scene.sign_at(joint, *velocity))).collect();
        let variance: f64 = (0..laws.len())
            .flat_map(|a| (0..laws.len()).map(move |b| (a, b)))
            .map(|(a, b)| laws[a] * laws[b] * covariance[a * laws.len() + b])
            .sum();
        curve.torque.push(laws.iter().zip(&values).map(|(law, value)| law * value).sum());
        curve.sigma.push(variance.max(0.0).sqrt());
    }
    Some(curve)
}
