//! The problem with some hypotheses estimated: what each of the others would still gain.

use super::cholesky::PivotedCholesky;
use super::criterion::fall;
use super::hypotheses::HypothesisSet;
use super::linear::{INVISIBLE, dot};
use crate::criteria::search::ROWS_EACH;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatMut, MatRef, Par, Side};
use rayon::prelude::*;

/// Columns whose shares one thread computes at once.
const COLUMNS: usize = 256;

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
    /// What the set leaves of the Gram matrix of every hypothesis, one after another, row by row; the upper triangles are not kept.
    gram: Vec<f64>,
    /// Where in `gram` each begins.
    begin: Vec<usize>,
    /// The fall of the criterion by every hypothesis that can join, largest first.
    pub falls: Vec<(f64, usize)>,
}

/// What a set takes off every column of a pool, from which follows what parts of the set take.
pub(super) struct SetShares {
    set: Vec<usize>,
    factor: PivotedCholesky,
    /// Columns of the set in the pool.
    own: Vec<usize>,
    /// L^-1 of the set's products with every column: rank x columns, column by column.
    share: Vec<f64>,
    /// L^-1 of their products with the residual.
    along: Vec<f64>,
}

impl SetShares {
    /// From the factor of the set's Gram matrix and the products of the set's columns with all columns of the pool.
    pub fn of(pool: &HypothesisSet, set: &[usize], factor: PivotedCholesky, products: &[SetProducts]) -> Self {
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
        Self { set: set.to_vec(), factor, own, share, along }
    }

    /// The problem with the whole set estimated.
    pub fn whole(&self, pool: &HypothesisSet) -> Conditional {
        let changed = Changed { share: &self.share, along: &self.along, sign: -1.0 };
        let gradient = changed.gradients(&pool.gradient);
        let square = pool.square - dot(&self.along, &self.along);
        let gram = changed.grams(pool, |h| &pool.gram[h]);
        Conditional::of(pool, self.set.clone(), self.factor.rank(), (square, gradient, gram))
    }

    /// L^-T of the shares: what every column would take of each kept column of the set.
    pub fn coefficients(&self) -> Vec<f64> {
        let (rank, mut out) = (self.factor.rank(), self.share.clone());
        let lower = self.factor.lower();
        out.par_chunks_mut((rank * COLUMNS).max(1)).for_each(|some| {
            let count = some.len() / rank;
            let some = MatMut::from_column_major_slice_mut(some, rank, count);
            solve_upper_triangular_in_place(lower.as_ref().transpose(), some, Par::Seq);
        });
        out
    }

    /// The problem without some members of the set, from that with all of them (`whole`) and their `coefficients`: what the members had
    /// taken comes back. `None` where columns that the set hid would be seen again, so that it has to be asked anew.
    ///
    /// With A the inverse of the set's Gram matrix and W the coefficients, without the columns G the Gram matrix of what is left grows by
    /// W_G' A_GG^-1 W_G (block elimination).
    pub fn without(
        &self,
        pool: &HypothesisSet,
        whole: &Conditional,
        coefficients: &[f64],
        gone: &[usize],
    ) -> Option<Conditional> {
        let rank = self.factor.rank();
        let of_gone = |column: usize| gone.iter().any(|h| (pool.first[*h]..pool.first[h + 1]).contains(&column));
        let out: Vec<usize> = (0..rank).filter(|a| of_gone(self.own[self.factor.order[*a]])).collect();
        if out.is_empty() {
            return None;
        }
        let inverse = self.factor.inverse();
        let among = Mat::from_fn(out.len(), out.len(), |i, j| dot(inverse.col_as_slice(out[i]), inverse.col_as_slice(out[j])));
        let lower = among.llt(Side::Lower).ok()?.L().to_owned();
        let (count, own) = (out.len(), self.factor.backward(&self.along));
        let mut back = vec![0.0; count * pool.scale.len()];
        back.par_chunks_mut(count * COLUMNS).enumerate().for_each(|(chunk, back)| {
            for (n, column) in back.chunks_mut(count).enumerate() {
                let from = &coefficients[(chunk * COLUMNS + n) * rank..][..rank];
                column.iter_mut().zip(&out).for_each(|(value, a)| *value = from[*a]);
            }
            let some = back.len() / count;
            let back = MatMut::from_column_major_slice_mut(back, count, some);
            solve_lower_triangular_in_place(lower.as_ref(), back, Par::Seq);
        });
        let mut along = Mat::from_fn(count, 1, |i, _| own[out[i]]);
        solve_lower_triangular_in_place(lower.as_ref(), along.as_mut(), Par::Seq);
        let along = along.col_as_slice(0);
        let changed = Changed { share: &back, along, sign: 1.0 };
        let hidden = (0..self.own.len()).filter(|k| !self.factor.order.contains(k)).map(|k| self.own[k]);
        if hidden.filter(|column| !of_gone(*column)).any(|column| dot(changed.of(column), changed.of(column)) > 0.5 * INVISIBLE) {
            return None;
        }
        let gradient = changed.gradients(&whole.gradient);
        let gram = changed.grams(pool, |h| whole.gram_of(h));
        let rest = self.set.iter().copied().filter(|h| !gone.contains(h)).collect();
        Some(Conditional::of(pool, rest, rank - count, (whole.square + dot(along, along), gradient, gram)))
    }
}

/// What is taken off every column, or comes back.
struct Changed<'a> {
    /// A few numbers for each column, column by column.
    share: &'a [f64],
    /// The same of the residual.
    along: &'a [f64],
    sign: f64,
}

impl Changed<'_> {
    fn of(&self, column: usize) -> &[f64] {
        &self.share[column * self.along.len()..(column + 1) * self.along.len()]
    }

    fn gradients(&self, from: &[f64]) -> Vec<f64> {
        from.iter().enumerate().map(|(column, g)| g + self.sign * dot(self.of(column), self.along)).collect()
    }

    /// The Gram matrices of all hypotheses, one after another.
    fn grams<'g>(&self, pool: &HypothesisSet, from: impl Fn(usize) -> &'g [f64] + Sync) -> Vec<f64> {
        let one = |h: usize| {
            let (first, q) = (pool.first[h], pool.first[h + 1] - pool.first[h]);
            let mut gram = from(h).to_vec();
            for i in (0..q).filter(|_| !self.along.is_empty()) {
                for j in 0..=i {
                    gram[i * q + j] += self.sign * dot(self.of(first + i), self.of(first + j));
                }
            }
            gram
        };
        (0..pool.hypotheses.len()).into_par_iter().with_min_len(64).flat_map_iter(one).collect()
    }
}

impl Conditional {
    fn of(pool: &HypothesisSet, set: Vec<usize>, rank: usize, (square, gradient, gram): (f64, Vec<f64>, Vec<f64>)) -> Self {
        let mut begin = vec![0];
        for h in 0..pool.hypotheses.len() {
            begin.push(begin[h] + (pool.first[h + 1] - pool.first[h]).pow(2));
        }
        let mut out = Self { set, rank, square, gradient, gram, begin, falls: Vec::new() };
        let all = (0..pool.hypotheses.len()).into_par_iter().with_min_len(64).map(|h| (out.fall(pool, h), h));
        let mut falls: Vec<(f64, usize)> = all.filter(|(fall, _)| fall.is_finite()).collect();
        falls.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        out.falls = falls;
        out
    }

    fn gram_of(&self, h: usize) -> &[f64] {
        &self.gram[self.begin[h]..self.begin[h + 1]]
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

    fn factor(&self, pool: &HypothesisSet, h: usize) -> PivotedCholesky {
        PivotedCholesky::of(self.gram_of(h).to_vec(), pool.first[h + 1] - pool.first[h])
    }

    /// Whether a hypothesis could join this set.
    pub fn admits(&self, pool: &HypothesisSet, h: usize) -> bool {
        let rows = pool.residual_rows.saturating_sub(pool.rank() + self.rank);
        let small = *ROWS_EACH * (pool.first[h + 1] - pool.first[h]) <= rows;
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
