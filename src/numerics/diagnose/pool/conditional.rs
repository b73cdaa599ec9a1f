//! The problem with some hypotheses estimated: what each of the others would still gain.

use super::cholesky::PivotedCholesky;
use super::criterion::fall;
use super::hypotheses::HypothesisSet;
use super::linear::dot;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{MatMut, MatRef, Par};
use rayon::prelude::*;

/// Columns whose shares one thread computes at once.
const COLUMNS: usize = 256;
/// A group may have at most one parameter for so many residual rows.
const ROWS_EACH: usize = 4;

/// Products of one column of a set with all columns of the pool.
pub(super) struct SetProducts<'a> {
    /// Those of all columns of its hypothesis, which are this many, for one column of the pool after another.
    pub of_hypothesis: &'a [f64],
    pub count: usize,
    /// Its own place among them.
    pub own: usize,
}

impl SetProducts<'_> {
    /// The product with a column of the pool.
    fn with(&self, column: usize) -> f64 {
        self.of_hypothesis[column * self.count + self.own]
    }
}

/// The problem with a set of hypotheses estimated beside the base model.
pub(crate) struct Conditional {
    set: Vec<usize>,
    /// Parameters that the set adds to the base model.
    rank: usize,
    /// Squared residual.
    pub square: f64,
    /// Product of every column with the residual.
    gradient: Vec<f64>,
    /// What the set takes off every column: rank x columns, column by column.
    share: Vec<f64>,
    /// The fall of the criterion by every hypothesis that can join, largest first.
    pub falls: Vec<(f64, usize)>,
}

impl Conditional {
    /// From the factor of the set's Gram matrix and the products of the set's columns with all columns of the pool: the share of column
    /// c is L^-1 of its products.
    pub(super) fn of(pool: &HypothesisSet, set: &[usize], factor: &PivotedCholesky, products: &[SetProducts]) -> Self {
        let (rank, own) = (factor.rank(), pool.columns_of(set));
        let mut share = vec![0.0; rank * pool.scale.len()];
        if rank > 0 {
            let lower = factor.lower();
            let kept: Vec<&SetProducts> = factor.order.iter().map(|k| &products[*k]).collect();
            share.par_chunks_mut(rank * COLUMNS).enumerate().for_each(|(chunk, share)| {
                for (n, column) in share.chunks_mut(rank).enumerate() {
                    column.iter_mut().zip(&kept).for_each(|(value, products)| *value = products.with(chunk * COLUMNS + n));
                }
                let count = share.len() / rank;
                let share = MatMut::from_column_major_slice_mut(share, rank, count);
                solve_lower_triangular_in_place(lower.as_ref(), share, Par::Seq);
            });
        }
        let along = factor.forward(|k| pool.gradient[own[k]]);
        let square = pool.square - dot(&along, &along);
        let of = |column: usize| &share[column * rank..(column + 1) * rank];
        let gradient = pool.gradient.iter().enumerate().map(|(column, g)| g - dot(of(column), &along)).collect();
        let mut out = Self { set: set.to_vec(), rank, square, gradient, share, falls: Vec::new() };
        let all = (0..pool.hypotheses.len()).into_par_iter().with_min_len(64).map(|h| (out.fall(pool, h), h));
        let mut falls: Vec<(f64, usize)> = all.filter(|(fall, _)| fall.is_finite()).collect();
        falls.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        out.falls = falls;
        out
    }

    pub fn set(&self) -> &[usize] {
        &self.set
    }

    /// By how much hypothesis `h` would lower the squared residual, and how many parameters the data see of it.
    pub fn gain(&self, pool: &HypothesisSet, h: usize) -> (f64, usize) {
        let factor = self.factor(pool, h);
        let first = pool.first[h];
        (factor.forward(|k| self.gradient[first + k]).iter().map(|value| value * value).sum(), factor.rank())
    }

    /// The criterion's fall by hypothesis `h` for many residuals at once, which are as likely as the pool's: `gradients` is the
    /// hypothesis' columns x residuals, `squares` the residuals' squares. `each` receives residual and fall where `h` is seen.
    pub fn falls_of(
        &self,
        pool: &HypothesisSet,
        h: usize,
        gradients: MatRef<'_, f64>,
        squares: &[f64],
        mut each: impl FnMut(usize, f64),
    ) {
        let factor = self.factor(pool, h);
        if factor.rank() == 0 {
            return;
        }
        let mut solved: Vec<f64> = Vec::with_capacity(factor.rank());
        for (residual, square) in squares.iter().enumerate() {
            solved.clear();
            for (a, k) in factor.order.iter().enumerate() {
                let row = factor.row(a);
                let known: f64 = row.iter().zip(&solved).map(|(x, y)| x * y).sum();
                solved.push((gradients[(*k, residual)] - known) / row[a]);
            }
            let gain = solved.iter().map(|value| value * value).sum();
            each(residual, fall(pool.effective_rows, *square, gain, factor.rank(), pool.prior_penalty[h]));
        }
    }

    fn share_of(&self, column: usize) -> &[f64] {
        &self.share[column * self.rank..(column + 1) * self.rank]
    }

    fn factor(&self, pool: &HypothesisSet, h: usize) -> PivotedCholesky {
        let (first, q) = (pool.first[h], pool.first[h + 1] - pool.first[h]);
        let mut gram = pool.gram[h].clone();
        if self.rank > 0 {
            for i in 0..q {
                for j in 0..=i {
                    gram[i * q + j] -= dot(self.share_of(first + i), self.share_of(first + j));
                }
            }
        }
        PivotedCholesky::of(gram, q)
    }

    /// Whether a hypothesis could join this set.
    pub fn admits(&self, pool: &HypothesisSet, h: usize) -> bool {
        let rows = pool.residual_rows.saturating_sub(pool.rank() + self.rank);
        let small = ROWS_EACH * (pool.first[h + 1] - pool.first[h]) <= rows;
        let parted = pool.hypotheses[h].inherits && !pool.has_parent(h, &self.set);
        small && !parted && !self.set.iter().any(|k| pool.keys[*k] == pool.keys[h])
    }

    /// How much the criterion would fall with hypothesis `h`; minus infinity where it cannot join or is not seen.
    fn fall(&self, pool: &HypothesisSet, h: usize) -> f64 {
        if !self.admits(pool, h) {
            return f64::NEG_INFINITY;
        }
        let (gain, rank) = self.gain(pool, h);
        if rank == 0 { f64::NEG_INFINITY } else { fall(pool.effective_rows, self.square, gain, rank, pool.prior_penalty[h]) }
    }
}
