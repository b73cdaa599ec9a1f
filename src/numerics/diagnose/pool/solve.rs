//! A set of hypotheses estimated together.

use super::cholesky::PivotedCholesky;
use super::hypotheses::HypothesisSet;

/// Coefficients of a set of hypotheses.
pub(crate) struct Solution {
    /// By which the squared residual falls.
    pub gain: f64,
    /// How many parameters the data see.
    pub rank: usize,
    /// SI, one for every column of the set.
    pub coefficients: Vec<f64>,
}

/// Estimates a set of hypotheses together, beside the base model, from the factor of their Gram matrix.
pub(super) fn solve(pool: &HypothesisSet, set: &[usize], factor: PivotedCholesky) -> Solution {
    let columns = pool.columns_of(set);
    let forward = factor.forward(|k| pool.gradient[columns[k]]);
    let gain: f64 = forward.iter().map(|value| value * value).sum();
    let solved = factor.backward(&forward);
    let rank = factor.rank();
    let scale: Vec<f64> = columns.iter().map(|column| pool.scale[*column]).collect();
    let mut coefficients = vec![0.0; columns.len()];
    for (k, value) in factor.order.iter().zip(&solved) {
        coefficients[*k] = value / scale[*k];
    }
    Solution { gain, rank, coefficients }
}
