//! Friction of a joint over its velocity, with its band.

use super::cause::TorqueForm;
use super::problem::TorqueProblem;
use super::shape_slopes::{ShapeNumber, ShapeSlopes, slope};
use super::sweep::SweptColumns;
use super::types::FrictionCurve;
use crate::effect::Place;

/// Velocities on either side of zero.
const POINTS: usize = 30;

/// The curve of every joint whose set has friction.
pub(super) fn friction_curves(
    problem: &TorqueProblem,
    set: &[usize],
    sweep: &SweptColumns,
    uncertain: (&SweptColumns, &ShapeSlopes),
) -> Vec<FrictionCurve> {
    (0..problem.joints()).filter_map(|joint| curve(problem, set, sweep, uncertain, joint)).collect()
}

fn curve(
    problem: &TorqueProblem,
    set: &[usize],
    sweep: &SweptColumns,
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
    joint: usize,
) -> Option<FrictionCurve> {
    let scene = &problem.scene;
    let forms = set.iter().map(|number| (*number, &problem.all.forms[*number]));
    let own: Vec<_> =
        forms.filter(|(_, form)| form.place == Place::Joint(joint) && form.cause.friction(form, 0.0, 0.0).is_some()).collect();
    let columns: Vec<usize> = own.iter().flat_map(|(number, _)| problem.all.of(*number)).collect();
    if columns.is_empty() {
        return None;
    }
    let solution = sweep.solution();
    let value = |column: &usize| solution.iter().find(|(pivot, _)| pivot == column).map_or(0.0, |(_, value)| *value);
    let values: Vec<f64> = columns.iter().map(value).collect();
    let fastest = scene.velocity[joint].iter().map(|velocity| velocity.abs()).fold(0.0, f64::max);
    let points = (-(POINTS as i32)..=POINTS as i32).map(|point| fastest * f64::from(point) / POINTS as f64);
    let mut curve = FrictionCurve { joint, velocity: points.collect(), torque: Vec::new(), sigma: Vec::new() };
    let all: Vec<usize> = columns.iter().copied().chain(slopes.0.iter().map(|(_, column)| *column)).collect();
    let covariance = uncertain.covariance(&all);
    let share = scene.width_at(joint) / scene.sign_width;
    let law =
        |form: &TorqueForm, velocity: f64, width: f64| form.cause.friction(form, velocity, (velocity / (share * width)).tanh());
    for velocity in &curve.velocity {
        let of = |width: f64| own.iter().filter_map(move |(_, form)| law(form, *velocity, width));
        let laws: Vec<f64> = of(scene.sign_width).collect();
        let torque = |laws: &mut dyn Iterator<Item = f64>| laws.zip(&values).map(|(law, value)| law * value).sum::<f64>();
        let by_shape = |(number, _): &(ShapeNumber, usize)| match number {
            ShapeNumber::SignWidth => slope(scene.sign_width, |width| torque(&mut of(width))),
            ShapeNumber::Of(form, index) => {
                let Some(place) = own.iter().position(|(number, _)| number == form) else { return 0.0 };
                let form = own[place].1;
                let moved = |size: f64| law(&form.with_shape(*index, size), *velocity, scene.sign_width).unwrap_or(0.0);
                values[place] * slope(form.shape[*index], moved)
            }
        };
        let along: Vec<f64> = laws.iter().copied().chain(slopes.0.iter().map(by_shape)).collect();
        let count = along.len();
        let variance: f64 = (0..count * count).map(|entry| along[entry / count] * along[entry % count] * covariance[entry]).sum();
        curve.torque.push(torque(&mut laws.iter().copied()));
        curve.sigma.push(variance.max(0.0).sqrt());
    }
    Some(curve)
}
