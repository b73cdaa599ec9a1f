//! Least squares by a pivoted Cholesky factor of a small Gram matrix: what the data do not see is left out.

use super::linear::INVISIBLE;

/// A pivoted Cholesky factor of a small Gram matrix: what is below [`INVISIBLE`] is left out.
pub(super) struct PivotedCholesky {
    /// Kept columns in order.
    pub order: Vec<usize>,
    /// Lower triangle of the kept columns, row after row: row `a` has `a + 1` entries.
    triangle: Vec<f64>,
}

impl PivotedCholesky {
    /// Of a q x q matrix, row by row; only its lower triangle is read.
    pub fn of(mut gram: Vec<f64>, q: usize) -> Self {
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

    pub fn row(&self, a: usize) -> &[f64] {
        let start = a * (a + 1) / 2;
        &self.triangle[start..=start + a]
    }

    pub fn rank(&self) -> usize {
        self.order.len()
    }

    /// L^-1 of a vector over all columns.
    pub fn forward(&self, vector: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut out: Vec<f64> = Vec::with_capacity(self.rank());
        for (a, k) in self.order.iter().enumerate() {
            let row = self.row(a);
            let known: f64 = row.iter().zip(&out).map(|(a, b)| a * b).sum();
            out.push((vector(*k) - known) / row[row.len() - 1]);
        }
        out
    }

    /// L^-T of a vector over the kept columns.
    pub fn backward(&self, vector: &[f64]) -> Vec<f64> {
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
