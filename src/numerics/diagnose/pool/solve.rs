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
    factor: PivotedCholesky,
    /// Variance of the residual's scatter.
    scatter: f64,
    /// Raw length of every column.
    scale: Vec<f64>,
}

impl Solution {
    /// Standard error of a coefficient from the residual's scatter, SI; zero of one that the data do not see.
    pub fn error(&self, column: usize) -> f64 {
        let Some(seen) = self.factor.order.iter().position(|k| *k == column) else { return 0.0 };
        // Diagonal of (L L^T)^-1: |L^-1 e|^2, whose entries before its own are zero.
        let mut lower: Vec<f64> = Vec::with_capacity(self.rank - seen);
        for b in seen..self.rank {
            let row = &self.factor.row(b)[seen..];
            let known: f64 = row.iter().zip(&lower).map(|(x, y)| x * y).sum();
            lower.push((f64::from(u8::from(b == seen)) - known) / row[b - seen]);
        }
        (self.scatter * lower.iter().map(|value| value * value).sum::<f64>()).sqrt() / self.scale[column]
    }
}

/// Estimates a set of hypotheses together, beside the base model, from the factor of their Gram matrix.
pub(super) fn solve(pool: &HypothesisSet, set: &[usize], factor: PivotedCholesky) -> Solution {
    let columns = pool.columns_of(set);
    let forward = factor.forward(|k| pool.gradient[columns[k]]);
    let gain: f64 = forward.iter().map(|value| value * value).sum();
    let solved = factor.backward(&forward);
    let rank = factor.rank();
    let freedom = pool.residual_rows.saturating_sub(pool.rank() + rank).max(1) as f64;
    let scatter = (pool.square - gain).max(0.0) / freedom * pool.residual_rows as f64 / pool.effective_rows;
    let scale: Vec<f64> = columns.iter().map(|column| pool.scale[*column]).collect();
    let mut coefficients = vec![0.0; columns.len()];
    for (k, value) in factor.order.iter().zip(&solved) {
        coefficients[*k] = value / scale[*k];
    }
    Solution { gain, rank, coefficients, factor, scatter, scale }
}
