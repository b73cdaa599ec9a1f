//! How well shape numbers are known: by the curvature of what is left, with all coefficients fitted at every step.

use crate::diagnose::regression::FormRegression;
use crate::effect::Form;
use nalgebra::DMatrix;

/// Steps as shares of a shape number's range.
const STEP: f64 = 1e-3;

/// One standard deviation of each shape number of a form that fits best; none where what is left has no minimum there.
pub(super) fn shape_sigmas(form: &Form, given: &FormRegression) -> Vec<Option<f64>> {
    let Some(declared) = form.declared() else {
        return Vec::new();
    };
    let steps = declared.shape_steps(STEP);
    let count = steps.len();
    let unknown = vec![None; count];
    if count == 0 || declared.declaration().pattern().jumps() {
        return unknown;
    }
    let at = |moves: &[(usize, f64)]| {
        let mut shift = vec![0.0; count];
        moves
            .iter()
            .for_each(|(k, times)| shift[*k] += times * steps[*k]);
        declared.shifted(&shift)
    };
    let pairs: Vec<(usize, usize)> = (0..count)
        .flat_map(|a| (0..=a).map(move |b| (a, b)))
        .collect();
    let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
    let forms: Vec<Form> = pairs
        .iter()
        .flat_map(|(a, b)| corners.map(|(i, j)| at(&[(*a, i), (*b, j)])))
        .collect();
    let gains = given.gains(&forms);
    // Squares of whitened residuals fall by the gain: half of their second derivatives is the information.
    let mut information = DMatrix::zeros(count, count);
    for ((a, b), gain) in pairs.into_iter().zip(gains.chunks(4)) {
        let second = -(gain[0] - gain[1] - gain[2] + gain[3]) / (4.0 * steps[a] * steps[b]);
        information[(a, b)] = 0.5 * second;
        information[(b, a)] = 0.5 * second;
    }
    let Some(covariance) = information.try_inverse() else {
        return unknown;
    };
    (0..count)
        .map(|k| {
            Some(covariance[(k, k)])
                .filter(|variance| *variance > 0.0)
                .map(f64::sqrt)
        })
        .collect()
}
