//! How far every row stands from what the other rows say: the leave-one-out residual against its own covariance.
//!
//! Whitened residual e, leverage H = J (J'WJ)^-1 J', Huber weight w: left out, e becomes (1 - wH)^-1 e, of covariance
//! 1 + H (1 - wH)^-1. Rows that were not fitted have w = 0.

use crate::estimate::model::Model;
use crate::estimate::problem::Problem;
use crate::estimate::term::{HUBER, ObservationTerm};
use crate::estimate::triangle::Triangle;
use crate::observation::{KINDS, MeasurementKind, noise};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// Where a row stands.
pub(super) struct LeaveOneOut {
    /// Predicted point, m.
    pub predicted: Vector3<f64>,
    /// Measured - predicted, m.
    pub residual: Vector3<f64>,
    /// Standard deviation per axis that a row of this kind has, m.
    pub sigma: f64,
    /// Length of the leave-one-out residual in standard deviations.
    pub distance: f64,
}

/// A direction in which a row alone decides more than this cannot be tested: nothing contradicts the row.
const SOLE: f64 = 0.98;
/// Rows handled at once.
const CHUNK: usize = 64;

/// The standing of every row of the recording after a fit of `free` to the problem's rows.
pub(super) fn leave_one_out(problem: &Problem, model: &Model, free: &[usize]) -> Vec<LeaveOneOut> {
    let data = problem.data;
    let inverse = problem.evaluate(model, free).factor.inverse();
    let mut column = vec![usize::MAX; model.stack.specs().len()];
    for (j, parameter) in free.iter().enumerate() {
        column[*parameter] = j;
    }
    let mut fitted = vec![false; data.rows()];
    for row in problem.rows {
        fitted[*row] = true;
    }
    let p = free.len();
    let screened: Vec<&dyn MeasurementKind> = KINDS.iter().copied().filter(|kind| kind.about().is_screened).collect();
    (0..data.rows())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map_init(
            || (model.stack.scratch(&model.robot), vec![Vector3::zeros(); p]),
            |(scratch, jacobian), row| {
                let mut placed = model.place(data, row, scratch);
                let predicted = placed.point;
                let away = |kind: &&'static dyn MeasurementKind| {
                    let (term, _) = ObservationTerm::of(*kind, data, row, &placed, problem.excess)?;
                    jacobian.fill(Vector3::zeros());
                    term.derivatives(&mut placed, |parameter, derivative| {
                        if let Some(entry) = jacobian.get_mut(column[parameter]) {
                            *entry += derivative;
                        }
                    });
                    let weight = match term.error.norm() {
                        _ if !fitted[row] => 0.0,
                        length if length > HUBER => HUBER / length,
                        _ => 1.0,
                    };
                    let leverage = inverse.as_ref().map_or_else(Matrix3::zeros, |inverse| leverage(jacobian, inverse));
                    Some(distance(&term.error, leverage, weight))
                };
                let distance = screened.iter().filter_map(away).fold(0.0, f64::max);
                LeaveOneOut {
                    predicted,
                    residual: data.residual(row, &predicted),
                    sigma: noise(data, row).hypot(3f64.sqrt() * problem.excess.length) / 3f64.sqrt(),
                    distance,
                }
            },
        )
        .collect()
}

/// H = G G', G = J R^-1 of the whitened derivatives, R^-1 upper triangular.
fn leverage(jacobian: &[Vector3<f64>], inverse: &Triangle) -> Matrix3<f64> {
    let mut leverage = Matrix3::zeros();
    for column in 0..jacobian.len() {
        let g: Vector3<f64> = jacobian.iter().zip(inverse.column(column)).map(|(derivative, share)| derivative * *share).sum();
        leverage += g * g.transpose();
    }
    leverage
}

fn distance(whitened: &Vector3<f64>, leverage: Matrix3<f64>, weight: f64) -> f64 {
    let eigen = SymmetricEigen::new(leverage);
    let along = eigen.eigenvectors.transpose() * whitened;
    let squares = (0..3).map(|k| {
        let h = eigen.eigenvalues[k].max(0.0);
        let rest = 1.0 - weight * h;
        if rest < 1.0 - SOLE { 0.0 } else { along[k] * along[k] / (rest * (rest + h)) }
    });
    squares.sum::<f64>().sqrt()
}
