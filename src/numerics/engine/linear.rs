//! Dense linear algebra on columns that are stored one after another.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::DMatrix;
use std::ops::Deref;
use std::sync::OnceLock;

/// Takes off a column what it has of another one of unit length.
pub fn subtract(column: &mut [f64], other: &[f64]) {
    let share = dot(column, other);
    let each = column.iter_mut().zip(other);
    each.for_each(|(value, other)| *value -= share * other);
}

/// Scales a column to unit length; returns the length that it had.
pub fn scale(column: &mut [f64]) -> f64 {
    let length = dot(column, column).sqrt();
    let each = column.iter_mut();
    each.for_each(|value| *value /= length.max(1e-300));
    length
}

/// An orthonormal basis of what the columns of `matrix` can do that shows: of the directions that whitened rows know better than the
/// parameters' standard deviations before any measurement, `sigmas`, do. Columns beyond these have any size.
pub fn shown_directions(matrix: &Mat<f64>, sigmas: &[f64]) -> Mat<f64> {
    let scale = |j: usize| match sigmas.get(j) {
        Some(sigma) => *sigma,
        None => ANY / matrix.col(j).norm_l2().max(1e-300),
    };
    let scale: Vec<f64> = (0..matrix.ncols()).map(scale).collect();
    let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] * scale[j]
    });
    let factors = scaled.qr();
    let Ok(svd) = factors.thin_R().svd() else {
        return factors.compute_thin_Q();
    };
    let sizes = svd.S().column_vector();
    let shown = (0..sizes.nrows()).filter(|k| sizes[*k] > 1.0).count();
    factors.compute_thin_Q() * svd.U().subcols(0, shown)
}

/// Length of a column of any size, in standard deviations.
const ANY: f64 = 1e6;

/// Removes from columns (one after another) what lies in the span of an orthonormal basis.
pub fn project(basis: MatRef<'_, f64>, columns: &mut [f64]) {
    let rows = basis.nrows();
    let count = columns.len() / rows.max(1);
    if basis.ncols() == 0 || count == 0 {
        return;
    }
    let mut share = Mat::zeros(basis.ncols(), count);
    let mut columns = MatMut::from_column_major_slice_mut(columns, rows, count);
    let (out, transposed) = (share.as_mut(), basis.transpose());
    matmul(
        out,
        Accum::Replace,
        transposed,
        columns.as_ref(),
        1.0,
        Par::Seq,
    );
    let (out, share) = (columns.as_mut(), share.as_ref());
    matmul(out, Accum::Add, basis, share, -1.0, Par::Seq);
}

/// Transpose of `a` times `b`; where one has fewer rows the others count as zero.
pub fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> DMatrix<f64> {
    let rows = a.nrows().min(b.nrows());
    let (a, b) = (a.subrows(0, rows), b.subrows(0, rows));
    let mut products = DMatrix::zeros(a.ncols(), b.ncols());
    let out = MatMut::from_column_major_slice_mut(products.as_mut_slice(), a.ncols(), b.ncols());
    matmul(out, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    products
}

/// Columns, one after another, and the same line by line once somebody asks.
pub struct Columns {
    columns: DMatrix<f64>,
    by_line: OnceLock<DMatrix<f64>>,
}

impl Columns {
    /// Columns x lines.
    pub fn by_line(&self) -> &DMatrix<f64> {
        self.by_line.get_or_init(|| self.columns.transpose())
    }
}

impl From<DMatrix<f64>> for Columns {
    fn from(columns: DMatrix<f64>) -> Self {
        Self {
            columns,
            by_line: OnceLock::new(),
        }
    }
}

impl Deref for Columns {
    type Target = DMatrix<f64>;

    fn deref(&self) -> &DMatrix<f64> {
        &self.columns
    }
}

/// A matrix of one library as the other one sees it.
#[inline]
pub fn view(matrix: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols())
}

/// The mean of squares; 0 of none.
pub fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64
}

/// The sum of the products of two columns.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums: the compiler may not reorder one.
    let (mut sums, chunks) = ([0.0; 4], a.len() / 4);
    for k in 0..chunks {
        for lane in 0..4 {
            sums[lane] += a[4 * k + lane] * b[4 * k + lane];
        }
    }
    let tail: f64 = (4 * chunks..a.len()).map(|k| a[k] * b[k]).sum();
    sums[0] + sums[1] + sums[2] + sums[3] + tail
}
