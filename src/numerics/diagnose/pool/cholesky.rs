//! Least squares by a pivoted Cholesky factor of a small Gram matrix: what the data do not see is left out.

use super::linear::INVISIBLE;
use faer::Mat;

/// A pivoted Cholesky factor of a small Gram matrix: what is below [`INVISIBLE`] is left out.
pub(super) struct PivotedCholesky {
    /// Kept columns in order.
    pub order: Vec<usize>,
    /// Lower triangle of the kept columns, row after row: row `a` has `a + 1` entries.
    triangle: Vec<f64>,
}

impl PivotedCholesky {
    /// The factor of a q x q matrix, row by row; only its lower triangle is read. A column is computed when it is chosen: until then only
    /// what is left on its diagonal is kept.
    pub fn of(gram: Vec<f64>, q: usize) -> Self {
        let mut order: Vec<usize> = (0..q).collect();
        let mut left: Vec<f64> = (0..q).map(|k| gram[k * (q + 1)]).collect();
        // Columns of the factor, one after another.
        let mut columns: Vec<f64> = Vec::with_capacity(q * q);
        let mut rank = 0;
        while let Some(pivot) = (rank..q).max_by(|a, b| left[*a].total_cmp(&left[*b])) {
            let size = left[pivot];
            if size <= INVISIBLE {
                break;
            }
            left.swap(rank, pivot);
            order.swap(rank, pivot);
            columns.chunks_mut(q).for_each(|column| column.swap(rank, pivot));
            let (root, own) = (size.sqrt(), order[rank]);
            columns.resize((rank + 1) * q, 0.0);
            let (known, column) = columns.split_at_mut(rank * q);
            let column = &mut column[rank..];
            column[0] = root;
            let below = &mut column[1..];
            below.iter_mut().zip(&order[rank + 1..]).for_each(|(value, k)| *value = gram[own.max(*k) * q + own.min(*k)]);
            subtract(below, known, rank, q);
            for (value, left) in below.iter_mut().zip(&mut left[rank + 1..]) {
                *value /= root;
                *left -= *value * *value;
            }
            rank += 1;
        }
        order.truncate(rank);
        let mut triangle = Vec::with_capacity(rank * (rank + 1) / 2);
        (0..rank).for_each(|a| triangle.extend((0..=a).map(|k| columns[k * q + a])));
        Self { order, triangle }
    }

    pub fn row(&self, a: usize) -> &[f64] {
        let start = a * (a + 1) / 2;
        &self.triangle[start..=start + a]
    }

    /// The whole factor, lower triangular.
    pub fn lower(&self) -> Mat<f64> {
        Mat::from_fn(self.rank(), self.rank(), |i, j| if j <= i { self.row(i)[j] } else { 0.0 })
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

/// Takes off the rows below the next one what the `known` columns, `rank` of `q` entries each, have of them: four at once, in their order.
fn subtract(below: &mut [f64], known: &[f64], rank: usize, q: usize) {
    let parts = |column: &'_ [f64]| (column[rank], rank + 1);
    for four in known.chunks(4 * q) {
        let mut each = four.chunks(q);
        if let [Some(a), Some(b), Some(c), Some(d)] = [each.next(), each.next(), each.next(), each.next()] {
            let [(p, from), (r, _), (s, _), (t, _)] = [a, b, c, d].map(parts);
            let rows = a[from..].iter().zip(&b[from..]).zip(&c[from..]).zip(&d[from..]);
            for (value, (((a, b), c), d)) in below.iter_mut().zip(rows) {
                *value = *value - p * a - r * b - s * c - t * d;
            }
        } else {
            for column in four.chunks(q) {
                let (own, from) = parts(column);
                below.iter_mut().zip(&column[from..]).for_each(|(value, other)| *value -= own * other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_that_of_the_matrix_in_its_order_and_what_is_invisible_is_left_out() {
        // Columns of a 7 x 5 matrix, the fourth of which is the sum of the first two.
        let entry = |i: usize, j: usize| ((3 * i + 5 * j * j + 2 * i * j) % 7) as f64 / 7.0 - 0.4;
        let value = |i: usize, j: usize| if j == 3 { entry(i, 0) + entry(i, 1) } else { entry(i, j) };
        let gram: Vec<f64> = (0..25).map(|k| (0..7).map(|i| value(i, k / 5) * value(i, k % 5)).sum()).collect();
        let factor = PivotedCholesky::of(gram.clone(), 5);
        assert_eq!(factor.rank(), 4);
        for (a, i) in factor.order.iter().enumerate() {
            for (b, j) in factor.order.iter().enumerate() {
                let product: f64 = factor.row(a).iter().zip(factor.row(b)).map(|(x, y)| x * y).sum();
                assert!((product - gram[i * 5 + j]).abs() < 1e-12, "{i} {j}");
            }
        }
        // Forward and backward solve the normal equations of the kept columns.
        let right = [1.0, -2.0, 0.5, 3.0, 0.25];
        let solved = factor.backward(&factor.forward(|k| right[k]));
        for i in &factor.order {
            let sum: f64 = factor.order.iter().zip(&solved).map(|(j, x)| gram[i * 5 + j] * x).sum();
            assert!((sum - right[*i]).abs() < 1e-9);
        }
    }
}
