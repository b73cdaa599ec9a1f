//! Numbers that a controller takes, solved anew: everything else nominal, by least squares onto the points of the identified model in the
//! robot's own base, under tolerances as priors.

use crate::compensate::IdentifiedArm;
use crate::estimate::Model;
use crate::robot::Measurements;
use nalgebra::{DMatrix, DVector, Vector3};

/// Poses that a list is solved on, at most: evenly among the recorded ones.
const MOST_POSES: usize = 400;
/// Rounds of Gauss and Newton, each with the error of the round before as the standard deviation of a coordinate.
const ROUNDS: usize = 6;
/// m: no list is better than this.
const FINEST: f64 = 1e-6;

/// Lengths of errors, m.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PointError {
    pub(crate) mean: f64,
    pub(crate) most: f64,
    rms: f64,
}

impl PointError {
    pub(crate) fn of(off: impl Iterator<Item = Vector3<f64>>) -> Self {
        let lengths: Vec<f64> = off.map(|off| off.norm()).collect();
        let count = lengths.len().max(1) as f64;
        Self {
            mean: lengths.iter().sum::<f64>() / count,
            most: lengths.iter().copied().fold(0.0, f64::max),
            rms: (lengths.iter().map(|one| one * one).sum::<f64>() / count).sqrt(),
        }
    }

    /// Whether it is worse than another one, by more than rounding.
    pub(crate) fn is_worse(&self, other: &Self) -> bool {
        self.rms > other.rms + FINEST
    }
}

/// Rows of a recording, evenly spread, and the points of the identified model there, in the robot's own base, m.
pub(super) struct WantedPoints {
    pub(crate) rows: Vec<usize>,
    pub(crate) points: Vec<Vector3<f64>>,
}

impl WantedPoints {
    /// The measurement's own faults (of the instrument, of rows) are none of the arm's.
    pub(crate) fn of(model: &Model, data: &Measurements) -> Self {
        let count = data.rows().min(MOST_POSES);
        let rows: Vec<usize> = (0..count).map(|k| k * data.rows() / count).collect();
        let arm = IdentifiedArm::new(model.clone(), None);
        let base = arm.base().inverse();
        let all = arm.model().predict(data);
        let points = rows.iter().map(|row| base.point(&all[*row])).collect();
        Self { rows, points }
    }

    pub(crate) fn error(&self, points: &[Vector3<f64>]) -> PointError {
        let pairs = self.points.iter().zip(points);
        PointError::of(pairs.map(|(wanted, point)| wanted - point))
    }
}

/// Numbers that were solved.
pub(super) struct EnteredNumbers {
    /// In the order of the tolerances, SI.
    pub(crate) values: Vec<f64>,
    /// Their covariance, the error that is left being noise.
    pub(crate) covariance: DMatrix<f64>,
    /// Without them, and with them.
    pub(crate) nothing: PointError,
    pub(crate) left: PointError,
}

/// The numbers, each 0 within its tolerance before, that bring `predicted` (the points of the rows, m) nearest to the wanted ones.
pub(super) fn solve(
    tolerances: &[f64],
    wanted: &WantedPoints,
    predicted: impl Fn(&[f64]) -> Vec<Vector3<f64>>,
) -> EnteredNumbers {
    let count = tolerances.len();
    let nothing = wanted.error(&predicted(&vec![0.0; count]));
    let (mut values, mut left) = (vec![0.0; count], nothing);
    let mut covariance = DMatrix::zeros(count, count);
    for _ in 0..ROUNDS {
        // In tolerances: then no number is nearer to rounding than another one.
        let sigma = (left.rms / 3f64.sqrt()).max(FINEST);
        let at = predicted(&values);
        let mut normal = DMatrix::identity(count, count);
        let mut right = DVector::from_fn(count, |k, _| -values[k] / tolerances[k]);
        let columns: Vec<Vec<Vector3<f64>>> = (0..count)
            .map(|k| {
                let step = 1e-3 * tolerances[k];
                let moved = |by: f64| {
                    let mut values = values.clone();
                    values[k] += by;
                    predicted(&values)
                };
                let pairs = moved(step).into_iter().zip(moved(-step));
                let scale = tolerances[k] / (2.0 * step * sigma);
                pairs
                    .map(|(ahead, behind)| (ahead - behind) * scale)
                    .collect()
            })
            .collect();
        let off: Vec<Vector3<f64>> = (wanted.points.iter().zip(&at))
            .map(|(wanted, point)| (wanted - point) / sigma)
            .collect();
        let dot = |a: &[Vector3<f64>], b: &[Vector3<f64>]| -> f64 {
            a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
        };
        for i in 0..count {
            right[i] += dot(&columns[i], &off);
            for k in 0..=i {
                let sum = dot(&columns[i], &columns[k]);
                normal[(i, k)] += sum;
                if i != k {
                    normal[(k, i)] += sum;
                }
            }
        }
        let Some(factor) = normal.cholesky() else {
            break;
        };
        let step = factor.solve(&right);
        for (value, (step, tolerance)) in values.iter_mut().zip(step.iter().zip(tolerances)) {
            *value += step * tolerance;
        }
        left = wanted.error(&predicted(&values));
        let inverse = factor.inverse();
        let scaled = |i: usize, k: usize| inverse[(i, k)] * tolerances[i] * tolerances[k];
        covariance = DMatrix::from_fn(count, count, scaled);
    }
    EnteredNumbers {
        values,
        covariance,
        nothing,
        left,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_found_and_a_direction_that_no_point_shows_stays_nominal() {
        let wanted = WantedPoints {
            rows: (0..20).collect(),
            points: (0..20)
                .map(|k| Vector3::new(f64::from(k) * 1e-3, 2e-3, 0.0))
                .collect(),
        };
        let predicted = |x: &[f64]| -> Vec<Vector3<f64>> {
            let point = |k: i32| Vector3::new(f64::from(k) * x[0], x[1] + x[2], 0.0);
            (0..20).map(point).collect()
        };
        let found = solve(&[3e-3, 3e-3, 1e-3], &wanted, predicted);
        assert!((found.values[0] - 1e-3).abs() < 1e-8, "{:?}", found.values);
        // The sum is shown; its parts stand as their variances.
        assert!((found.values[1] - 1.8e-3).abs() < 1e-6 && (found.values[2] - 0.2e-3).abs() < 1e-6);
        assert!(
            found.left.rms < 1e-6
                && found.nothing.rms > 1e-3
                && !found.left.is_worse(&found.nothing)
        );
        assert!(found.covariance[(1, 1)].sqrt() > 0.5e-3);
    }
}
