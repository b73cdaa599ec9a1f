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
    /// Standard errors from the residual's scatter, SI.
    pub errors: Vec<f64>,
}

/// Estimates a set of hypotheses together, beside the base model, from the factor of their Gram matrix.
pub(super) fn solve(pool: &HypothesisSet, set: &[usize], factor: &PivotedCholesky) -> Solution {
    let columns = pool.columns_of(set);
    let q = columns.len();
    let forward = factor.forward(|k| pool.gradient[columns[k]]);
    let gain: f64 = forward.iter().map(|value| value * value).sum();
    let solved = factor.backward(&forward);
    let rank = factor.rank();
    let freedom = pool.residual_rows.saturating_sub(pool.rank() + rank).max(1) as f64;
    let scatter = (pool.square - gain).max(0.0) / freedom * pool.residual_rows as f64 / pool.effective_rows;
    let (mut coefficients, mut errors) = (vec![0.0; q], vec![0.0; q]);
    for (a, k) in factor.order.iter().enumerate() {
        let scale = pool.scale[columns[*k]];
        coefficients[*k] = solved[a] / scale;
        let mut unit = vec![0.0; rank];
        unit[a] = 1.0;
        // Row a of (L L^T)^-1: |L^-1 e_a|^2.
        let mut lower: Vec<f64> = Vec::with_capacity(rank);
        for (b, value) in unit.iter().enumerate() {
            let row = factor.row(b);
            let known: f64 = row.iter().zip(&lower).map(|(x, y)| x * y).sum();
            lower.push((value - known) / row[b]);
        }
        errors[*k] = (scatter * lower.iter().map(|value| value * value).sum::<f64>()).sqrt() / scale;
    }
    Solution { gain, rank, coefficients, errors }
}
