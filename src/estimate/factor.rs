//! The triangular factor of a tall least-squares problem, built chunk by chunk: bounded memory, no squared condition number.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{qr_in_place, qr_in_place_scratch, recommended_block_size};
use faer::{Mat, MatMut, Par};

/// Upper triangular factor R of the rows `[J | r]`: its last column is Q^T r, so R alone states the least-squares problem.
#[derive(Debug, Clone)]
pub struct Factor {
    /// (p + 1) x (p + 1), upper triangular.
    r: Mat<f64>,
}

/// Rows `[J | r]` on their way into a factor: chunks are written below the factor of those before them.
pub(crate) struct Tall {
    /// Column-major; the first `top` rows hold the factor so far.
    rows: Mat<f64>,
    top: usize,
    reflectors: Mat<f64>,
    memory: MemBuffer,
}

impl Tall {
    /// Room for chunks of `chunk` rows with `columns` = p + 1 columns.
    pub fn new(columns: usize, chunk: usize) -> Self {
        let height = columns + chunk;
        let block = recommended_block_size::<f64>(height, columns);
        let memory = MemBuffer::new(qr_in_place_scratch::<f64>(height, columns, block, Par::Seq, Default::default()));
        Self { rows: Mat::zeros(height, columns), top: 0, reflectors: Mat::zeros(block, columns), memory }
    }

    /// The next chunk of `height` rows; all zero.
    pub fn chunk(&mut self, height: usize) -> MatMut<'_, f64> {
        self.rows.as_mut().subrows_mut(self.top, height)
    }

    /// Takes the `height` rows written to [`Tall::chunk`] into the factor.
    pub fn absorb(&mut self, height: usize) {
        let (used, columns) = (self.top + height, self.rows.ncols());
        let reflectors = self.reflectors.as_mut().subcols_mut(0, columns.min(used));
        let rows = self.rows.as_mut().subrows_mut(0, used);
        qr_in_place(rows, reflectors, Par::Seq, MemStack::new(&mut self.memory), Default::default());
        self.top = columns.min(used);
        for j in 0..columns {
            // What faer leaves below the diagonal are its reflectors.
            let below = (j + 1).min(used);
            self.rows.as_mut().col_mut(j).subrows_mut(below, used - below).fill(0.0);
        }
    }

    /// The factor of all chunks.
    pub fn factor(&self) -> Factor {
        let columns = self.rows.ncols();
        Factor { r: Mat::from_fn(columns, columns, |i, j| if i <= j && i < self.top { self.rows[(i, j)] } else { 0.0 }) }
    }
}

impl Factor {
    /// The factor of rows `[J | r]` (m x (p + 1)).
    pub fn of(rows: &Mat<f64>) -> Self {
        let mut tall = Tall::new(rows.ncols(), rows.nrows());
        tall.chunk(rows.nrows()).copy_from(rows);
        tall.absorb(rows.nrows());
        tall.factor()
    }

    /// The factor of both sets of rows together.
    pub fn stack(&self, other: &Factor) -> Self {
        let columns = self.r.ncols();
        let rows =
            Mat::from_fn(2 * columns, columns, |i, j| if i < columns { self.r[(i, j)] } else { other.r[(i - columns, j)] });
        Self::of(&rows)
    }

    /// The factor of the problem in some of the parameters only.
    pub fn select(&self, parameters: &[usize]) -> Self {
        let columns = self.r.ncols();
        let p = self.parameters();
        Self::of(&Mat::from_fn(columns, parameters.len() + 1, |i, j| self.r[(i, parameters.get(j).copied().unwrap_or(p))]))
    }

    /// The problem that is left in the parameters without an entry when the others take the given steps.
    pub fn given(&self, steps: &[Option<f64>]) -> Self {
        let p = self.parameters();
        let open: Vec<usize> = (0..p).filter(|j| steps[*j].is_none()).collect();
        let mut rows = Mat::from_fn(p + 1, open.len() + 1, |i, j| self.r[(i, open.get(j).copied().unwrap_or(p))]);
        for (j, step) in steps.iter().enumerate() {
            for i in 0..=j {
                rows[(i, open.len())] -= self.r[(i, j)] * step.unwrap_or_default();
            }
        }
        Self::of(&rows)
    }

    /// The factor of the same rows, all multiplied by `weight`.
    pub fn weighted(mut self, weight: f64) -> Self {
        for j in 0..self.r.ncols() {
            for i in 0..=j {
                self.r[(i, j)] *= weight;
            }
        }
        self
    }

    /// An entry of R; row and column p are the right-hand side's.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        self.r[(i, j)]
    }

    pub fn parameters(&self) -> usize {
        self.r.ncols() - 1
    }

    /// Column `j` of R (without the right-hand side's row), above the diagonal and on it.
    pub fn column(&self, j: usize) -> Vec<f64> {
        (0..self.parameters()).map(|i| self.r[(i, j)]).collect()
    }

    /// Norm of column j of the Jacobian.
    pub fn column_norm(&self, j: usize) -> f64 {
        (0..self.parameters()).map(|i| self.r[(i, j)].powi(2)).sum::<f64>().sqrt()
    }

    /// J^T r.
    pub fn gradient(&self) -> Vec<f64> {
        let p = self.parameters();
        (0..p).map(|j| (0..=j).map(|i| self.r[(i, j)] * self.r[(i, p)]).sum()).collect()
    }

    /// The step of least |J dx - r|^2 + damping |D dx|^2, D the column norms (Marquardt's scaling). `None` if singular.
    pub fn solve(&self, damping: f64) -> Option<Vec<f64>> {
        let p = self.parameters();
        let scale: Vec<f64> = (0..p).map(|j| self.column_norm(j)).collect();
        if scale.iter().any(|norm| *norm <= 0.0 || !norm.is_finite()) {
            return None;
        }
        let scaled = |i: usize, j: usize| if j < p { self.r[(i, j)] / scale[j] } else { self.r[(i, p)] };
        let small = if damping == 0.0 {
            Self { r: Mat::from_fn(p, p + 1, scaled) }
        } else {
            let root = damping.sqrt();
            let damped = |i: usize, j: usize| if i - p == j { root } else { 0.0 };
            Self::of(&Mat::from_fn(2 * p, p + 1, |i, j| if i < p { scaled(i, j) } else { damped(i, j) }))
        };
        let mut step = vec![0.0; p];
        for i in (0..p).rev() {
            let diagonal = small.r[(i, i)];
            if diagonal.abs() < 1e-14 {
                return None;
            }
            let known: f64 = (i + 1..p).map(|j| small.r[(i, j)] * step[j]).sum();
            step[i] = (small.r[(i, p)] - known) / diagonal;
        }
        Some(step.iter().zip(&scale).map(|(value, norm)| value / norm).collect())
    }

    /// The inverse of R (p x p), so that the covariance is `inverse * inverse^T`. `None` if singular.
    pub fn inverse(&self) -> Option<Mat<f64>> {
        let p = self.parameters();
        let mut inverse = Mat::zeros(p, p);
        for column in 0..p {
            for i in (0..=column).rev() {
                let diagonal = self.r[(i, i)];
                if diagonal == 0.0 {
                    return None;
                }
                let known: f64 = (i + 1..=column).map(|j| self.r[(i, j)] * inverse[(j, column)]).sum();
                inverse[(i, column)] = (if i == column { 1.0 } else { 0.0 } - known) / diagonal;
            }
        }
        Some(inverse)
    }

    /// Singular values of J with columns scaled by `scale`, largest first.
    pub fn singular_values(&self, scale: &[f64]) -> Vec<f64> {
        let p = self.parameters();
        if p == 0 {
            return Vec::new();
        }
        let scaled = Mat::from_fn(p, p, |i, j| self.r[(i, j)] * scale[j]);
        scaled.singular_values().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_give_the_same_solution_as_one_piece() {
        let value = |i: usize, j: usize| ((i * 7 + j * 13) % 11) as f64 - 5.0 + ((i * i + j) as f64).sin();
        let rows = Mat::from_fn(40, 5, value);
        let whole = Factor::of(&rows);
        let top = Factor::of(&Mat::from_fn(3, 5, value));
        let bottom = Factor::of(&Mat::from_fn(37, 5, |i, j| value(i + 3, j)));
        let both = top.stack(&bottom);
        let (a, b) = (whole.solve(0.0).unwrap(), both.solve(0.0).unwrap());
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-12);
        }
        // Normal equations hold at the solution.
        for j in 0..4 {
            let gradient: f64 =
                (0..40).map(|i| rows[(i, j)] * ((0..4).map(|k| rows[(i, k)] * a[k]).sum::<f64>() - rows[(i, 4)])).sum();
            assert!(gradient.abs() < 1e-10);
        }
    }
}
