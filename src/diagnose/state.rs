//! The problem with some hypotheses estimated: what each of the others would still gain.

use super::pool::{LINES_EACH, Pool, dot, gram, project};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::sync::OnceLock;

/// What is left of a squared column of unit length below this is rounding and second order, not sight.
const INVISIBLE: f64 = 1e-6;

/// Columns whose shares one thread computes at once.
const COLUMNS: usize = 256;

/// Coefficients of a set of hypotheses.
pub(crate) struct Solution {
    /// By which the squared residual falls.
    pub gain: f64,
    /// How many numbers the data see.
    pub rank: usize,
    /// SI, one for every column of the set.
    pub coefficients: Vec<f64>,
    /// Standard errors from the residual's scatter, SI.
    pub errors: Vec<f64>,
}

/// A pivoted Cholesky factor of a small Gram matrix: what is below [`INVISIBLE`] is left out.
struct Pivoted {
    /// Kept columns in order.
    order: Vec<usize>,
    /// Lower triangle of the kept columns, row after row: row `a` has `a + 1` entries.
    triangle: Vec<f64>,
}

impl Pivoted {
    /// Of a q x q matrix, row by row; only its lower triangle is read.
    fn of(mut gram: Vec<f64>, q: usize) -> Self {
        let mut order: Vec<usize> = Vec::with_capacity(q);
        let mut left: Vec<usize> = (0..q).collect();
        // Column k of the factor is kept in the upper triangle's place: entry (pivot, other).
        let mut columns: Vec<f64> = Vec::with_capacity(q * q);
        let at = |i: usize, j: usize| if i >= j { i * q + j } else { j * q + i };
        while let Some(best) = (0..left.len()).max_by(|a, b| gram[left[*a] * (q + 1)].total_cmp(&gram[left[*b] * (q + 1)])) {
            let pivot = left[best];
            let size = gram[pivot * (q + 1)];
            if size <= INVISIBLE {
                break;
            }
            left.swap_remove(best);
            let inverse = 1.0 / size.sqrt();
            let start = columns.len();
            columns.resize(start + q, 0.0);
            columns[start + pivot] = size.sqrt();
            for other in &left {
                columns[start + other] = gram[at(*other, pivot)] * inverse;
            }
            for (n, i) in left.iter().enumerate() {
                let own = columns[start + i];
                for j in &left[..=n] {
                    gram[at(*i, *j)] -= own * columns[start + j];
                }
            }
            order.push(pivot);
        }
        let rank = order.len();
        let mut triangle = Vec::with_capacity(rank * (rank + 1) / 2);
        for (a, pivot) in order.iter().enumerate() {
            triangle.extend((0..=a).map(|column| columns[column * q + pivot]));
        }
        Self { order, triangle }
    }

    fn row(&self, a: usize) -> &[f64] {
        let start = a * (a + 1) / 2;
        &self.triangle[start..=start + a]
    }

    fn rank(&self) -> usize {
        self.order.len()
    }

    /// L^-1 of a vector over all columns.
    fn forward(&self, vector: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut out: Vec<f64> = Vec::with_capacity(self.rank());
        for (a, k) in self.order.iter().enumerate() {
            let row = self.row(a);
            let known: f64 = row.iter().zip(&out).map(|(a, b)| a * b).sum();
            out.push((vector(*k) - known) / row[row.len() - 1]);
        }
        out
    }

    /// L^-T of a vector over the kept columns.
    fn backward(&self, vector: &[f64]) -> Vec<f64> {
        let mut out = vector.to_vec();
        for a in (0..self.rank()).rev() {
            let row = self.row(a);
            out[a] /= row[a];
            let own = out[a];
            out.iter_mut().zip(&row[..a]).for_each(|(value, entry)| *value -= entry * own);
        }
        out
    }
}

/// Estimates a set of hypotheses together, beside the base model.
pub(crate) fn solve(pool: &Pool, set: &[usize]) -> Solution {
    let columns = pool.columns_of(set);
    let q = columns.len();
    let factor = Pivoted::of(pool.gram_of(set), q);
    let forward = factor.forward(|k| pool.gradient[columns[k]]);
    let gain: f64 = forward.iter().map(|value| value * value).sum();
    let solved = factor.backward(&forward);
    let rank = factor.rank();
    let freedom = pool.lines.saturating_sub(pool.rank() + rank).max(1) as f64;
    let scatter = (pool.square - gain).max(0.0) / freedom * pool.lines as f64 / pool.count;
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

/// The problem with a set of hypotheses estimated.
pub(crate) struct State {
    pub set: Vec<usize>,
    /// Numbers that the set adds to the base model.
    pub rank: usize,
    /// Squared residual.
    pub square: f64,
    /// Orthonormal columns that the set spans: lines x rank.
    pub basis: Mat<f64>,
    /// Product of every column with the residual.
    pub gradient: Vec<f64>,
    /// What the set takes off every column: rank x columns, column by column.
    share: Vec<f64>,
    /// [`State::falls`] once they are known.
    falls: OnceLock<Vec<(f64, usize)>>,
}

impl State {
    pub fn of(pool: &Pool, set: &[usize]) -> Self {
        let columns = pool.columns_of(set);
        let basis = span(pool, &columns);
        let rank = basis.ncols();
        let mut share = vec![0.0; rank * pool.scale.len()];
        if rank > 0 {
            let all = pool.all();
            share.par_chunks_mut(rank * COLUMNS).enumerate().for_each(|(chunk, share)| {
                let count = share.len() / rank;
                let some = all.subcols(chunk * COLUMNS, count);
                let share = MatMut::from_column_major_slice_mut(share, rank, count);
                matmul(share, Accum::Replace, basis.transpose(), some, 1.0, Par::Seq);
            });
        }
        let along: Vec<f64> = (0..rank).map(|k| dot(column(&basis, k), &pool.residual)).collect();
        let square = pool.square - dot(&along, &along);
        let of = |column: usize| &share[column * rank..(column + 1) * rank];
        let gradient = pool.gradient.iter().enumerate().map(|(column, g)| g - dot(of(column), &along)).collect();
        Self { set: set.to_vec(), rank, square, basis, gradient, share, falls: OnceLock::new() }
    }

    /// By how much hypothesis `h` would lower the squared residual with `gradient`, and how many numbers the data see of it.
    pub fn gain(&self, pool: &Pool, h: usize) -> (f64, usize) {
        let factor = self.factor(pool, h);
        let first = pool.first[h];
        (factor.forward(|k| self.gradient[first + k]).iter().map(|value| value * value).sum(), factor.rank())
    }

    /// The same for many residuals at once: `gradients` is the hypothesis' columns x draws.
    pub fn gains(&self, pool: &Pool, h: usize, gradients: &Mat<f64>, mut each: impl FnMut(usize, f64, usize)) {
        let factor = self.factor(pool, h);
        let mut solved: Vec<f64> = Vec::with_capacity(factor.rank());
        for draw in 0..gradients.ncols() {
            solved.clear();
            for (a, k) in factor.order.iter().enumerate() {
                let row = factor.row(a);
                let known: f64 = row.iter().zip(&solved).map(|(x, y)| x * y).sum();
                solved.push((gradients[(*k, draw)] - known) / row[a]);
            }
            each(draw, solved.iter().map(|value| value * value).sum(), factor.rank());
        }
    }

    fn share_of(&self, column: usize) -> &[f64] {
        &self.share[column * self.rank..(column + 1) * self.rank]
    }

    fn factor(&self, pool: &Pool, h: usize) -> Pivoted {
        let (first, q) = (pool.first[h], pool.first[h + 1] - pool.first[h]);
        let mut gram = pool.gram[h].clone();
        if self.rank > 0 {
            for i in 0..q {
                for j in 0..=i {
                    gram[i * q + j] -= dot(self.share_of(first + i), self.share_of(first + j));
                }
            }
        }
        Pivoted::of(gram, q)
    }

    /// Whether a hypothesis could join this set.
    pub fn admits(&self, pool: &Pool, h: usize) -> bool {
        let lines = pool.lines.saturating_sub(pool.rank() + self.rank);
        let small = LINES_EACH * (pool.first[h + 1] - pool.first[h]) <= lines;
        small && !self.set.iter().any(|k| pool.keys[*k] == pool.keys[h])
    }

    /// The fall of the criterion by every hypothesis that can join, largest first.
    pub fn falls(&self, pool: &Pool) -> &[(f64, usize)] {
        self.falls.get_or_init(|| {
            let all = (0..pool.hypotheses.len()).into_par_iter().with_min_len(64).map(|h| (self.fall(pool, h), h));
            let mut all: Vec<(f64, usize)> = all.filter(|(fall, _)| fall.is_finite()).collect();
            all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            all
        })
    }

    /// How much the criterion would fall with hypothesis `h`; minus infinity where it cannot join or is not seen.
    pub fn fall(&self, pool: &Pool, h: usize) -> f64 {
        if !self.admits(pool, h) {
            return f64::NEG_INFINITY;
        }
        let (gain, rank) = self.gain(pool, h);
        if rank == 0 { f64::NEG_INFINITY } else { fall(pool.count, self.square, gain, rank, pool.charge[h]) }
    }
}

/// Fall of the criterion by `rank` more numbers that lower the squared residual by `gain`.
pub(crate) fn fall(n: f64, square: f64, gain: f64, rank: usize, charge: f64) -> f64 {
    n * (square / (square - gain).max(1e-300)).ln() - n.ln() * rank as f64 - charge
}

/// A column of a matrix, which are stored one after another.
fn column(matrix: &Mat<f64>, k: usize) -> &[f64] {
    matrix.col(k).try_as_col_major().map_or(&[], |column| column.as_slice())
}

/// Columns that are made orthonormal at once.
const BLOCK: usize = 16;

/// Orthonormal basis of some of the pool's columns; what is below [`INVISIBLE`] is left out.
pub(crate) fn span(pool: &Pool, columns: &[usize]) -> Mat<f64> {
    let lines = pool.lines;
    let mut basis: Vec<f64> = Vec::with_capacity(columns.len() * lines);
    for block in columns.chunks(BLOCK) {
        let mut rest: Vec<f64> = block.iter().flat_map(|column| pool.column(*column)).copied().collect();
        // Twice is enough (Giraud, Langou and Rozloznik, 2005).
        for _ in 0..2 {
            project(MatRef::from_column_major_slice(&basis, lines, basis.len() / lines), &mut rest);
        }
        let first = basis.len();
        for column in rest.chunks_mut(lines) {
            for _ in 0..2 {
                for direction in basis[first..].chunks(lines) {
                    let along = dot(column, direction);
                    column.iter_mut().zip(direction).for_each(|(value, b)| *value -= along * b);
                }
            }
            let size = dot(column, column);
            if size > INVISIBLE {
                let root = size.sqrt();
                basis.extend(column.iter().map(|value| value / root));
            }
        }
    }
    MatRef::from_column_major_slice(&basis, lines, basis.len() / lines).to_owned()
}

/// By how much columns (one after another, unit raw length, projected) lower a squared residual.
pub(crate) fn gain(columns: &[f64], lines: usize, residual: &[f64]) -> f64 {
    let own: Vec<&[f64]> = columns.chunks(lines).collect();
    let factor = Pivoted::of(gram(&own), own.len());
    factor.forward(|k| dot(own[k], residual)).iter().map(|value| value * value).sum()
}
