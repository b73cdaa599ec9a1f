//! How well the joints repeat: one standard deviation for all, by maximum likelihood on repeats or on a residual without structure.

use crate::diagnose::types::JointRepeatability;
use crate::diagnose::whitened::WhitenedProblem;
use crate::estimate::{Fitted, Model, Poses};
use crate::observation::values;
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

/// Pairs of rows that measured one target in one pose again.
pub(super) struct RepeatPairs {
    pairs: Vec<[usize; 2]>,
    /// Whether the arm was elsewhere between the rows of some: what changes with time or side of approach is then in their difference.
    pub are_returns: bool,
}

impl RepeatPairs {
    /// Right after each other, where those are enough; else also returns, those after a shorter time, which drifts spoil least.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        if data.in_motion(rows) {
            // Rows of a halt tell nothing of what the joints do on the way.
            return Self { pairs: Vec::new(), are_returns: false };
        }
        let poses = Poses::of(data, rows);
        let pairs = poses.repeated().flat_map(|rows| rows.windows(2).map(|pair| [pair[0], pair[1]]));
        let at_once = |[a, b]: &[usize; 2]| {
            let [from, to] = [data.place(*a), data.place(*b)];
            let mut between = (from.min(to) + 1..from.max(to)).map(|place| data.at_place(place));
            between.all(|k| data.near_pose(*a, k) && data.target(k) != data.target(*a))
        };
        let (mut pairs, mut returns): (Vec<[usize; 2]>, Vec<[usize; 2]>) = pairs.partition(at_once);
        if pairs.len() >= REPEATS || returns.is_empty() {
            pairs.sort_unstable_by_key(|pair| pair[1]);
            return Self { pairs, are_returns: false };
        }
        returns.sort_unstable_by_key(|[a, b]| (b - a, *b));
        returns.truncate(returns.len().div_ceil(2).max(REPEATS));
        pairs.extend(returns);
        pairs.sort_unstable_by_key(|pair| pair[1]);
        Self { pairs, are_returns: true }
    }

    /// The joints' repeatability by what the pairs differ beyond the motion that `model` knows between them. `spread` as of [`spreads`].
    pub fn repeatability(&self, model: &Model, data: &Measurements, spread: &[Matrix3<f64>]) -> JointRepeatability {
        let repeats = self.pairs.len();
        if repeats < FEW {
            return JointRepeatability { sigma: 0.0, repeats };
        }
        let predicted = model.predict(data);
        let one = |[a, b]: &[usize; 2]| {
            let variance = |row: usize| Matrix3::from_diagonal(&data.sigma[row].map(|s| s * s));
            let known =
                if self.are_returns || !data.same_pose(*a, *b) { predicted[*b] - predicted[*a] } else { Vector3::zeros() };
            (data.position[*b] - data.position[*a] - known, variance(*a) + variance(*b), spread[*b] * 2.0)
        };
        JointRepeatability { sigma: likeliest(&self.pairs.iter().map(one).collect::<Vec<_>>(), 2.0), repeats }
    }
}

/// The joints' repeatability (rad) by what a fit leaves of the whole points of `rows` that holds no structure any more; 0 without any.
pub(super) fn by_residual(model: &Model, fitted: &Fitted, rows: &[usize], data: &Measurements, spread: &[Matrix3<f64>]) -> f64 {
    let predicted = model.predict(data);
    let numbers: usize = rows.iter().map(|row| values(data, *row)).sum();
    let freedom = (numbers as f64 / numbers.saturating_sub(fitted.singular.len()).max(1) as f64).sqrt();
    let one = |row: &usize| {
        let residual = data.position[*row] - predicted[*row];
        (residual * freedom, Matrix3::from_diagonal(&data.sigma[*row].map(|s| s * s)), spread[*row])
    };
    likeliest(&rows.iter().filter(|row| data.whole(**row)).map(one).collect::<Vec<_>>(), 6.0)
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
