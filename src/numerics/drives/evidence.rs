//! What a fit is worth: the evidence of its rows and priors, and the odds of a member against nothing.

use crate::fit::DriveFit;
use crate::sizes::Sizes;
use nalgebra::{DMatrix, DVector};

/// The statement of the noise counts as so many rows.
const NU: f64 = 20.0;

/// ln of the likelihood of a squared residual: with the scale of the noise integrated where it is above its statement.
fn log_likelihood(square: f64, rows: f64, independence: f64) -> f64 {
    let n = rows * independence;
    if square < rows {
        -0.5 * independence * (square - rows)
    } else {
        -0.5 * (n + NU) * ((NU + square * independence) / (NU + n)).ln()
    }
}

impl DriveFit {
    /// Share of independent rows: the larger of the estimates from this model's residual and from that of a rich one.
    pub fn share(&self) -> f64 {
        self.independence.max(self.rich)
    }

    /// Inverse of the posterior's variance, in units of the priors.
    fn precision(&self, independence: f64) -> DMatrix<f64> {
        let scale = (self.square / self.freedom).max(1.0);
        let count = self.gram.nrows();
        &self.gram * (independence / scale) + DMatrix::identity(count, count)
    }

    /// ln of the odds of a member against nothing: its prior over its posterior where it is nothing (Dickey, 1971); `None` where no number
    /// of it is 0 then.
    pub fn odds(&self, member: usize, independence: f64) -> Option<f64> {
        let one = &self.set[member];
        let shape = &one.cell.shapes[one.shape];
        let sizes = Sizes::of(one);
        let columns: Option<Vec<usize>> = sizes
            .numbers
            .iter()
            .map(|k| {
                self.numbers
                    .iter()
                    .position(|number| *number == (member, *k))
            })
            .collect();
        let columns = columns.filter(|columns| !columns.is_empty())?;
        let inverse = self.precision(independence).cholesky()?.inverse();
        let nb = self.inertia.len();
        let count = columns.len();
        let variance = DMatrix::from_fn(count, count, |i, k| {
            inverse[(nb + columns[i], nb + columns[k])]
        });
        let width = sizes.precision().sqrt();
        let size = DVector::from_fn(count, |i, _| {
            let k = sizes.numbers[i];
            one.numbers[k] * width / shape.usual[k]
        });
        let factor = variance.cholesky()?;
        let half_log_det: f64 = factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        Some(
            0.5 * size.dot(&factor.solve(&size))
                + half_log_det
                + sizes.log_tail()
                + one.cell.log_prior
                + shape.log_weight,
        )
    }

    /// What evidence may be reached at most where the squared residual still falls by so much.
    pub(crate) fn reach(&self, falls: f64, independence: f64) -> f64 {
        log_likelihood((self.square - falls).max(0.0), self.freedom, independence) + self.log_prior
    }

    /// ln of the evidence, where so large a share of the rows is independent.
    pub fn log_evidence(&self, independence: f64) -> f64 {
        let whole = self.precision(independence);
        let log_det = whole.cholesky().map_or(f64::INFINITY, |factor| {
            2.0 * factor
                .l_dirty()
                .diagonal()
                .iter()
                .map(|d| d.ln())
                .sum::<f64>()
        });
        let tails: f64 = self.set.iter().map(|one| Sizes::of(one).log_tail()).sum();
        log_likelihood(self.square, self.freedom, independence) - 0.5 * self.penalty - 0.5 * log_det
            + tails
            + self.log_prior
    }
}
