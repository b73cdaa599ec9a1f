//! The triangular factor of a tall least-squares problem, built chunk by chunk: bounded memory, no squared condition number.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::qr::no_pivoting::factor::{
    qr_in_place, qr_in_place_scratch, recommended_block_size,
};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatMut, Par, Side};

/// Upper triangular factor R of the rows `[J | r]`: its last column is Q^T r, so R alone states the least-squares problem.
#[derive(Debug, Clone)]
pub(crate) struct TriangularFactor {
    /// (p + 1) x (p + 1).
    r: Triangle,
}

/// What rows `[J | r]` come to, chunk by chunk.
pub(crate) trait RowSums: Sized {
    /// What becomes of them.
    type Sum: Send;

    /// Room for chunks of `chunk` rows with `columns` = p + 1 columns.
    fn new(columns: usize, chunk: usize) -> Self;
    /// The columns of the next chunk of `height` rows; all zero.
    fn chunk(&mut self, height: usize) -> Vec<&mut [f64]>;
    /// Takes the `height` rows written to [`RowSums::chunk`].
    fn absorb(&mut self, height: usize);
    /// Of all chunks.
    fn sum(self) -> Self::Sum;
    /// Of two sets of rows together.
    fn both(a: Self::Sum, b: Self::Sum) -> Self::Sum;
}

/// Rows `[J | r]` on their way into the sums of their products, the lower triangle.
pub(crate) struct SummedRows {
    rows: Mat<f64>,
    products: Mat<f64>,
}

impl RowSums for SummedRows {
    type Sum = Mat<f64>;

    fn new(columns: usize, chunk: usize) -> Self {
        Self {
            rows: Mat::zeros(chunk, columns),
            products: Mat::zeros(columns, columns),
        }
    }

    fn chunk(&mut self, height: usize) -> Vec<&mut [f64]> {
        let columns = self.rows.col_iter_mut().map(|column| {
            let column = column.try_as_col_major_mut().expect("stored by column");
            &mut column.as_slice_mut()[..height]
        });
        columns.collect()
    }

    fn absorb(&mut self, height: usize) {
        let rows = self.rows.as_ref().subrows(0, height);
        let (lower, whole) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
        triangular::matmul(
            self.products.as_mut(),
            lower,
            Accum::Add,
            rows.transpose(),
            whole,
            rows,
            whole,
            1.0,
            Par::Seq,
        );
        self.rows.fill(0.0);
    }

    fn sum(self) -> Mat<f64> {
        self.products
    }

    fn both(a: Mat<f64>, b: Mat<f64>) -> Mat<f64> {
        a + b
    }
}

/// Rows `[J | r]` on their way into a factor: chunks are written below the factor of those before them.
pub(crate) struct StackedRows {
    /// Column-major; the first `top` rows hold the factor so far.
    rows: Mat<f64>,
    top: usize,
    reflectors: Mat<f64>,
    memory: MemBuffer,
}

impl RowSums for StackedRows {
    type Sum = TriangularFactor;

    fn new(columns: usize, chunk: usize) -> Self {
        let height = columns + chunk;
        let block = recommended_block_size::<f64>(height, columns);
        let memory = MemBuffer::new(qr_in_place_scratch::<f64>(
            height,
            columns,
            block,
            Par::Seq,
            Default::default(),
        ));
        Self {
            rows: Mat::zeros(height, columns),
            top: 0,
            reflectors: Mat::zeros(block, columns),
            memory,
        }
    }

    fn chunk(&mut self, height: usize) -> Vec<&mut [f64]> {
        let top = self.top;
        let columns = self.rows.col_iter_mut().map(|column| {
            let column = column.try_as_col_major_mut().expect("stored by column");
            &mut column.as_slice_mut()[top..top + height]
        });
        columns.collect()
    }

    fn absorb(&mut self, height: usize) {
        let (used, columns) = (self.top + height, self.rows.ncols());
        let reflectors = self.reflectors.as_mut().subcols_mut(0, columns.min(used));
        let rows = self.rows.as_mut().subrows_mut(0, used);
        qr_in_place(
            rows,
            reflectors,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        );
        self.top = columns.min(used);
        for j in 0..columns {
            // What faer leaves below the diagonal are its reflectors.
            let below = (j + 1).min(used);
            self.rows.col_as_slice_mut(j)[below..used].fill(0.0);
        }
    }

    fn sum(self) -> TriangularFactor {
        TriangularFactor {
            r: Triangle::from_fn(self.rows.ncols(), |i, j| {
                if i < self.top {
                    self.rows.col_as_slice(j)[i]
                } else {
                    0.0
                }
            }),
        }
    }

    fn both(a: TriangularFactor, b: TriangularFactor) -> TriangularFactor {
        a.stack(&b)
    }
}

/// A column of unit length of which those before it leave less than this is not told from rounding.
const LEAST_PIVOT: f64 = 1e-6;

impl TriangularFactor {
    /// The factor of rows `[J | r]` by the lower triangle of the sums of their products; `None` where these do not tell a column of J from
    /// those before it.
    pub(crate) fn of_products(products: &Mat<f64>) -> Option<Self> {
        let p = products.ncols() - 1;
        let scale: Vec<f64> = (0..p).map(|j| products[(j, j)].sqrt()).collect();
        if scale.iter().any(|norm| !norm.is_finite() || *norm <= 0.0) {
            return None;
        }
        let scaled = Mat::from_fn(p, p, |i, j| match i >= j {
            true => products[(i, j)] / (scale[i] * scale[j]),
            false => 0.0,
        });
        let factor = scaled.llt(Side::Lower).ok()?;
        let lower = factor.L();
        if (0..p).any(|j| lower[(j, j)].is_nan() || lower[(j, j)] < LEAST_PIVOT) {
            return None;
        }
        let mut right: Vec<f64> = (0..p).map(|j| products[(p, j)] / scale[j]).collect();
        let out = MatMut::from_column_major_slice_mut(&mut right, p, 1);
        solve_lower_triangular_in_place(lower, out, Par::Seq);
        let left = (products[(p, p)] - dot(&right, &right)).max(0.0).sqrt();
        let entry = |i: usize, j: usize| match (i, j) {
            (i, j) if j < p => lower[(j, i)] * scale[j],
            (i, _) if i < p => right[i],
            _ => left,
        };
        Some(Self {
            r: Triangle::from_fn(p + 1, entry),
        })
    }

    /// The factor of rows `[J | r]` (m x (p + 1)).
    pub fn of(rows: &Mat<f64>) -> Self {
        let mut tall = StackedRows::new(rows.ncols(), rows.nrows());
        for (j, column) in tall.chunk(rows.nrows()).into_iter().enumerate() {
            column.copy_from_slice(rows.col_as_slice(j));
        }
        tall.absorb(rows.nrows());
        tall.sum()
    }

    /// The factor of rows made of some of this one's columns above each other's.
    fn of_columns<'a>(
        height: usize,
        columns: impl ExactSizeIterator<Item = [&'a [f64]; 2]>,
    ) -> Self {
        let mut tall = StackedRows::new(columns.len(), 2 * height);
        for (to, [above, below]) in tall.chunk(2 * height).into_iter().zip(columns) {
            to[..above.len()].copy_from_slice(above);
            to[height..height + below.len()].copy_from_slice(below);
        }
        tall.absorb(2 * height);
        tall.sum()
    }

    /// The factor of both sets of rows together.
    pub(crate) fn stack(&self, other: &TriangularFactor) -> Self {
        let columns = self.r.size();
        Self::of_columns(
            columns,
            (0..columns).map(|j| [self.r.column(j), other.r.column(j)]),
        )
    }

    /// The factor of the problem in some of the parameters only.
    pub(crate) fn select(&self, parameters: &[usize]) -> Self {
        let p = self.parameters();
        if parameters.iter().copied().eq(0..p) {
            return self.clone();
        }
        let columns: Vec<usize> = parameters.iter().copied().chain([p]).collect();
        Self::of_columns(p + 1, columns.iter().map(|j| [self.r.column(*j), &[]]))
    }

    /// The problem that is left in the parameters without an entry when the others take the given steps.
    pub(crate) fn given(&self, steps: &[Option<f64>]) -> Self {
        let p = self.parameters();
        if steps.iter().all(Option::is_none) {
            return self.clone();
        }
        let mut right = self.r.column(p).to_vec();
        for (j, step) in steps.iter().enumerate() {
            axpy(-step.unwrap_or_default(), self.r.column(j), &mut right);
        }
        let open: Vec<usize> = (0..p).filter(|j| steps[*j].is_none()).collect();
        let columns: Vec<&[f64]> = open
            .iter()
            .map(|j| self.r.column(*j))
            .chain([&right[..]])
            .collect();
        Self::of_columns(p + 1, columns.iter().map(|column| [column, &[][..]]))
    }

    /// The factor of the same rows, all multiplied by `weight`.
    pub(crate) fn weighted(mut self, weight: f64) -> Self {
        self.r.values.iter_mut().for_each(|value| *value *= weight);
        self
    }

    /// The same problem with `pull` beside J^T r: the downhill gradient of what is no sum of squares. Nothing where a column is nought.
    pub(crate) fn pulled(self, pull: &[f64]) -> Self {
        if pull.iter().all(|value| *value == 0.0) {
            return self;
        }
        let p = self.parameters();
        let mut more = vec![0.0; p];
        for j in 0..p {
            let column = self.r.column(j);
            let pivot = column[j];
            let known = dot(&column[..j], &more[..j]);
            more[j] = if pivot.abs() > 1e-12 * self.column_norm(j) {
                (pull[j] - known) / pivot
            } else {
                0.0
            };
        }
        let entry =
            |i: usize, j: usize| self.r.at(i, j) + if j == p && i < p { more[i] } else { 0.0 };
        Self {
            r: Triangle::from_fn(p + 1, entry),
        }
    }

    /// An entry of R; row and column p are the right-hand side's.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        self.r.at(i, j)
    }

    pub(crate) fn parameters(&self) -> usize {
        self.r.size() - 1
    }

    /// Column `j` of R down to the diagonal.
    pub(crate) fn column(&self, j: usize) -> &[f64] {
        self.r.column(j)
    }

    /// The right-hand side's rows beside R.
    fn right(&self) -> &[f64] {
        let p = self.parameters();
        &self.r.column(p)[..p]
    }

    /// Norm of column j of the Jacobian.
    pub(crate) fn column_norm(&self, j: usize) -> f64 {
        norm(self.r.column(j))
    }

    /// J^T r.
    pub(crate) fn gradient(&self) -> Vec<f64> {
        (0..self.parameters())
            .map(|j| dot(self.r.column(j), self.right()))
            .collect()
    }

    /// The step of least |J dx - r|^2 + damping |D dx|^2, D the column norms (Marquardt's scaling). `None` if singular.
    pub(crate) fn solve(&self, damping: f64) -> Option<Vec<f64>> {
        let p = self.parameters();
        let mut scale: Vec<f64> = (0..p).map(|j| self.column_norm(j)).collect();
        if scale.iter().any(|norm| *norm <= 0.0 || !norm.is_finite()) {
            return None;
        }
        scale.push(1.0);
        let scaled = Triangle::from_fn(p + 1, |i, j| self.r.at(i, j) / scale[j]);
        let small = if damping == 0.0 {
            scaled
        } else {
            let root = damping.sqrt();
            let damped = Triangle::from_fn(p + 1, |i, j| if i == j && j < p { root } else { 0.0 });
            Self { r: scaled }.stack(&Self { r: damped }).r
        };
        if (0..p).any(|j| small.at(j, j).abs() < 1e-14) {
            return None;
        }
        let mut step = small.column(p)[..p].to_vec();
        small.solve(&mut step);
        Some(
            step.iter()
                .zip(&scale)
                .map(|(value, norm)| value / norm)
                .collect(),
        )
    }

    /// The inverse of R (p x p), so that the covariance is `inverse * inverse^T`. `None` if singular.
    pub fn inverse(&self) -> Option<Triangle> {
        Triangle::from_fn(self.parameters(), |i, j| self.r.at(i, j)).inverse()
    }

    /// Singular values of J with columns scaled by `scale`, largest first.
    pub(crate) fn singular_values(&self, scale: &[f64]) -> Vec<f64> {
        let p = self.parameters();
        if p == 0 {
            return Vec::new();
        }
        let scaled = Mat::from_fn(p, p, |i, j| self.r.at(i, j) * scale[j]);
        scaled.singular_values().unwrap_or_default()
    }
}

/// Zero below the diagonal.
#[derive(Debug, Clone)]
pub(crate) struct Triangle {
    size: usize,
    /// Column j is `j + 1` long.
    values: Vec<f64>,
}

impl Triangle {
    /// `entry(i, j)` for `i <= j < size`.
    pub(crate) fn from_fn(size: usize, mut entry: impl FnMut(usize, usize) -> f64) -> Self {
        let mut values = Vec::with_capacity(size * (size + 1) / 2);
        for j in 0..size {
            for i in 0..=j {
                values.push(entry(i, j));
            }
        }
        Self { size, values }
    }

    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Column `j` down to the diagonal.
    pub(crate) fn column(&self, j: usize) -> &[f64] {
        let first = j * (j + 1) / 2;
        &self.values[first..=first + j]
    }

    pub(crate) fn at(&self, i: usize, j: usize) -> f64 {
        if i <= j {
            self.values[j * (j + 1) / 2 + i]
        } else {
            0.0
        }
    }

    /// As it is stored by faer, times `scale`.
    pub(crate) fn matrix(&self, scale: f64) -> Mat<f64> {
        Mat::from_fn(self.size, self.size, |i, j| self.at(i, j) * scale)
    }

    pub(crate) fn row_norm(&self, i: usize) -> f64 {
        let squares = (i..self.size).map(|j| self.at(i, j).powi(2));
        squares.sum::<f64>().sqrt()
    }

    /// Solves in place for a right-hand side that ends with row `right.len() - 1`. The diagonal must not be zero there.
    pub(crate) fn solve(&self, right: &mut [f64]) {
        for j in (0..right.len()).rev() {
            let column = self.column(j);
            let value = right[j] / column[j];
            right[j] = value;
            axpy(-value, &column[..j], &mut right[..j]);
        }
    }

    /// `None` where the diagonal has a zero.
    pub fn inverse(&self) -> Option<Self> {
        if (0..self.size).any(|j| self.at(j, j) == 0.0) {
            return None;
        }
        let mut inverse = Self::from_fn(self.size, |i, j| if i == j { 1.0 } else { 0.0 });
        for j in 0..self.size {
            let first = j * (j + 1) / 2;
            self.solve(&mut inverse.values[first..=first + j]);
        }
        Some(inverse)
    }
}

/// Four sums at once: three times as fast, and in a fixed order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let ((a, a_tail), (b, b_tail)) = (a[..length].as_chunks::<4>(), b[..length].as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let whole = sums[0] + sums[1] + sums[2] + sums[3];
    a_tail
        .iter()
        .zip(b_tail)
        .fold(whole, |sum, (a, b)| sum + a * b)
}

pub(crate) fn norm(values: &[f64]) -> f64 {
    dot(values, values).sqrt()
}

/// `to += by * from`.
pub(crate) fn axpy(by: f64, from: &[f64], to: &mut [f64]) {
    to.iter_mut()
        .zip(from)
        .for_each(|(to, from)| *to += by * from);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_times_its_inverse_is_one() {
        let triangle = Triangle::from_fn(7, |i, j| {
            if i == j {
                2.0 + j as f64
            } else {
                ((3 * i + 5 * j) % 7) as f64 - 3.0
            }
        });
        let inverse = triangle.inverse().unwrap();
        for i in 0..7 {
            for j in 0..7 {
                let entry: f64 = (0..7).map(|k| triangle.at(i, k) * inverse.at(k, j)).sum();
                assert!((entry - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        assert!(Triangle::from_fn(2, |i, _| i as f64).inverse().is_none());
    }

    #[test]
    fn chunks_give_the_same_solution_as_one_piece() {
        let value =
            |i: usize, j: usize| ((i * 7 + j * 13) % 11) as f64 - 5.0 + ((i * i + j) as f64).sin();
        let rows = Mat::from_fn(40, 5, value);
        let whole = TriangularFactor::of(&rows);
        let top = TriangularFactor::of(&Mat::from_fn(3, 5, value));
        let bottom = TriangularFactor::of(&Mat::from_fn(37, 5, |i, j| value(i + 3, j)));
        let both = top.stack(&bottom);
        let (a, b) = (whole.solve(0.0).unwrap(), both.solve(0.0).unwrap());
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-12);
        }
        // Normal equations hold at the solution.
        for j in 0..4 {
            let gradient: f64 = (0..40)
                .map(|i| {
                    rows[(i, j)] * ((0..4).map(|k| rows[(i, k)] * a[k]).sum::<f64>() - rows[(i, 4)])
                })
                .sum();
            assert!(gradient.abs() < 1e-10);
        }
    }
}
