//! How well the joints repeat: one standard deviation for all, by maximum likelihood on repeats or on a residual without structure.

use crate::robot::Measurements;
use nalgebra::{Matrix3, Vector3};

/// One joint repeatability (rad) and what it rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeatability {
    pub sigma: f64,
    /// Immediate repeats of a pose; none where it was taken from the residual.
    pub repeats: usize,
}

/// Fewer repeats than this say too little.
const FEW: usize = 4;
/// Standard deviations tried, rad.
const LOWEST: f64 = 5e-7;
const HIGHEST: f64 = 3e-4;
const STEPS: usize = 60;
/// A squared whitened error counts at most this much.
const CAP: f64 = 30.0;

/// Sum of outer products of the motions by each joint: covariance (m2) per squared joint deviation.
pub(crate) fn by_all(by_joint: &[Vector3<f64>]) -> Matrix3<f64> {
    by_joint.iter().map(|motion| motion * motion.transpose()).sum()
}

/// From immediate repeats among `rows`: row i measured the pose of the row before again. `spread[row]` is [`by_all`] of that row.
pub(crate) fn from_repeats(data: &Measurements, rows: &[usize], spread: &[Matrix3<f64>]) -> Repeatability {
    if data.in_motion(rows) {
        // Rows of a halt tell nothing of what the joints do on the way.
        return Repeatability { sigma: 0.0, repeats: 0 };
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
        return Repeatability { sigma: 0.0, repeats: pairs.len() };
    }
    Repeatability { sigma: likeliest(&pairs, 2.0), repeats: pairs.len() }
}

/// From residuals (m) of `rows` that hold no structure any more, with `parameters` estimated from them.
pub(crate) fn from_residuals(
    data: &Measurements,
    rows: &[usize],
    residuals: &[Vector3<f64>],
    spread: &[Matrix3<f64>],
    parameters: usize,
) -> Repeatability {
    let values = 3 * rows.len();
    let freedom = (values as f64 / values.saturating_sub(parameters).max(1) as f64).sqrt();
    let one = |(row, residual): (&usize, &Vector3<f64>)| {
        (residual * freedom, Matrix3::from_diagonal(&data.sigma[*row].map(|s| s * s)), spread[*row])
    };
    let all: Vec<_> = rows.iter().zip(residuals).map(one).collect();
    Repeatability { sigma: likeliest(&all, 6.0), repeats: 0 }
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
