//! How far every row stands from what the other rows say: the leave-one-out residual against its own covariance.
//!
//! Whitened residual e, leverage H = J (J'WJ)^-1 J', Huber weight w: left out, e becomes (1 - wH)^-1 e, of covariance
//! 1 + H (1 - wH)^-1. Rows that were not fitted have w = 0.

use crate::criteria::screen::SOLE;
use crate::estimate::model::Model;
use crate::estimate::problem::{HUBER, ObservationTerm, Problem};
use crate::observation::{KINDS, MeasurementKind, noise};
use faer::Mat;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use rayon::prelude::*;

/// Where a row stands.
pub(super) struct LeaveOneOut {
    /// Predicted point, m.
    pub(crate) predicted: Vector3<f64>,
    /// Measured - predicted, m.
    pub(crate) residual: Vector3<f64>,
    /// Standard deviation per axis that a row of this kind has, m.
    pub(crate) sigma: f64,
    /// Length of the leave-one-out residual in standard deviations.
    pub(crate) distance: f64,
}

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
    let inverse =
        inverse.map(|inverse| Mat::from_fn(free.len(), free.len(), |i, j| inverse.at(i, j)));
    let screened: Vec<&dyn MeasurementKind> = KINDS
        .iter()
        .copied()
        .filter(|kind| kind.about().is_screened)
        .collect();
    let chunk = |chunk: usize| {
        let rows = chunk * CHUNK..((chunk + 1) * CHUNK).min(data.rows());
        let mut scratch = model.stack.scratch(&model.robot);
        let mut lines: Mat<f64> = Mat::zeros(3 * screened.len() * rows.len(), free.len());
        let (mut terms, mut standings) = (Vec::new(), Vec::with_capacity(rows.len()));
        for (i, row) in rows.enumerate() {
            let mut placed = model.place(data, row, &mut scratch);
            let predicted = placed.point;
            for kind in &screened {
                let Some((term, _)) =
                    ObservationTerm::of(*kind, data, row, &placed, problem.excess)
                else {
                    continue;
                };
                let first = 3 * terms.len();
                term.derivatives(&mut placed, |parameter, derivative| {
                    if column[parameter] < free.len() {
                        let line = &mut lines.col_as_slice_mut(column[parameter])[first..first + 3];
                        line.iter_mut()
                            .zip(&derivative)
                            .for_each(|(value, d)| *value += d);
                    }
                });
                terms.push((i, fitted[row], term.error));
            }
            standings.push(LeaveOneOut {
                predicted,
                residual: data.points.residual(row, &predicted),
                sigma: noise(data, row).hypot(3f64.sqrt() * problem.excess.length) / 3f64.sqrt(),
                distance: 0.0,
            });
        }
        // H = G G', G = J R^-1 of the whitened derivatives.
        let seen = inverse
            .as_ref()
            .map_or_else(|| Mat::zeros(lines.nrows(), 1), |inverse| &lines * inverse);
        for (k, (i, fitted, error)) in terms.into_iter().enumerate() {
            let leverage = Matrix3::from_fn(|a, b| {
                (0..seen.ncols())
                    .map(|j| seen[(3 * k + a, j)] * seen[(3 * k + b, j)])
                    .sum()
            });
            let weight = match error.norm() {
                _ if !fitted => 0.0,
                length if length > HUBER => HUBER / length,
                _ => 1.0,
            };
            let standing = &mut standings[i];
            standing.distance = standing.distance.max(distance(&error, leverage, weight));
        }
        standings
    };
    (0..data.rows().div_ceil(CHUNK))
        .into_par_iter()
        .flat_map_iter(chunk)
        .collect()
}

fn distance(whitened: &Vector3<f64>, leverage: Matrix3<f64>, weight: f64) -> f64 {
    let eigen = SymmetricEigen::new(leverage);
    let along = eigen.eigenvectors.transpose() * whitened;
    let squares = (0..3).map(|k| {
        let h = eigen.eigenvalues[k].max(0.0);
        let rest = 1.0 - weight * h;
        if rest < 1.0 - *SOLE {
            0.0
        } else {
            along[k] * along[k] / (rest * (rest + h))
        }
    });
    squares.sum::<f64>().sqrt()
}
