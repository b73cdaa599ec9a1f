//! How well the joints repeat: one standard deviation for all, by maximum likelihood on repeats or on a residual without structure.

use crate::diagnose::types::JointRepeatability;
use crate::diagnose::whitened::WhitenedProblem;
use crate::estimate::{Fitted, Model};
use crate::robot::Measurements;
use nalgebra::{Matrix3, Vector3};

/// Repeats that make the noise known; with fewer it is taken from a residual without structure.
pub(crate) const REPEATS: usize = 10;
/// Fewer repeats than this say too little.
const FEW: usize = 4;
/// Standard deviations tried, rad.
const LOWEST: f64 = 5e-7;
const HIGHEST: f64 = 3e-4;
const STEPS: usize = 60;
/// A squared whitened error counts at most this much.
const CAP: f64 = 30.0;

/// Covariance (m2) of every row's point per squared joint deviation.
pub(super) fn spreads(model: &Model, data: &Measurements) -> Vec<Matrix3<f64>> {
    let problem = WhitenedProblem::new(model, data, (0..data.rows()).collect());
    let by_all = |row| problem.by_joint(row).iter().map(|motion| motion * motion.transpose()).sum();
    (0..data.rows()).map(by_all).collect()
}

/// Covariance (m2) of every row's point with this deviation (rad) of every joint.
pub(super) fn scaled(spread: &[Matrix3<f64>], sigma: f64) -> Vec<Matrix3<f64>> {
    spread.iter().map(|matrix| matrix * (sigma * sigma)).collect()
}

/// From immediate repeats among `rows`: row i measured the pose of the row before again. `spread` as of [`spreads`].
pub(super) fn from_repeats(data: &Measurements, rows: &[usize], spread: &[Matrix3<f64>]) -> JointRepeatability {
    if data.in_motion(rows) {
        // Rows of a halt tell nothing of what the joints do on the way.
        return JointRepeatability { sigma: 0.0, repeats: 0 };
    }
    let pairs: Vec<(Vector3<f64>, Matrix3<f64>, Matrix3<f64>)> = rows
        .windows(2)
        .filter(|pair| pair[1] == pair[0] + 1 && data.same_pose(pair[0], pair[1]))
        .map(|pair| {
            let variance = |row: usize| Matrix3::from_diagonal(&data.sigma[row].map(|s| s * s));
            let fixed = variance(pair[0]) + variance(pair[1]);
            (data.position[pair[1]] - data.position[pair[0]], fixed, spread[pair[1]] * 2.0)
        })
        .collect();
    if pairs.len() < FEW {
        return JointRepeatability { sigma: 0.0, repeats: pairs.len() };
    }
    JointRepeatability { sigma: likeliest(&pairs, 2.0), repeats: pairs.len() }
}

/// The joints' repeatability (rad) by what a fit leaves of `rows` that holds no structure any more.
pub(super) fn by_residual(model: &Model, fitted: &Fitted, rows: &[usize], data: &Measurements, spread: &[Matrix3<f64>]) -> f64 {
    let predicted = model.predict(data);
    let values = 3 * rows.len();
    let freedom = (values as f64 / values.saturating_sub(fitted.singular.len()).max(1) as f64).sqrt();
    let one = |row: &usize| {
        let residual = data.position[*row] - predicted[*row];
        (residual * freedom, Matrix3::from_diagonal(&data.sigma[*row].map(|s| s * s)), spread[*row])
    };
    likeliest(&rows.iter().map(one).collect::<Vec<_>>(), 6.0)
}

/// The likeliest deviation; none unless it is better than none by `evidence`.
fn likeliest(samples: &[(Vector3<f64>, Matrix3<f64>, Matrix3<f64>)], evidence: f64) -> f64 {
    let cost = |sigma: f64| -> f64 {
        let one = |(error, fixed, varying): &(Vector3<f64>, Matrix3<f64>, Matrix3<f64>)| {
            let covariance = fixed + varying * (sigma * sigma);
            let square = covariance.try_inverse().map_or(CAP, |inverse| error.dot(&(inverse * error)));
            square.min(CAP) + covariance.determinant().ln()
        };
        samples.iter().map(one).sum()
    };
    let none = cost(0.0);
    let steps = (0..STEPS).map(|k| LOWEST * libm::pow(HIGHEST / LOWEST, k as f64 / (STEPS - 1) as f64));
    let best = steps.map(|sigma| (cost(sigma), sigma)).min_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(cost, _)| *cost < none - evidence).map_or(0.0, |(_, sigma)| sigma)
}
