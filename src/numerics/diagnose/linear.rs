//! Dense linear algebra on columns that are stored one after another.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// An orthonormal basis of the columns of `matrix`, which are scaled to unit length first.
pub(crate) fn orthonormal(matrix: &Mat<f64>) -> Mat<f64> {
    let norm = |j: usize| matrix.col(j).norm_l2().max(1e-300);
    let scale: Vec<f64> = (0..matrix.ncols()).map(norm).collect();
    let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        matrix[(i, j)] / scale[j]
    });
    scaled.qr().compute_thin_Q()
}

/// Removes from columns (one after another) what lies in the span of an orthonormal basis.
pub(crate) fn project(basis: MatRef<'_, f64>, columns: &mut [f64]) {
    let rows = basis.nrows();
    let count = columns.len() / rows.max(1);
    if basis.ncols() == 0 || count == 0 {
        return;
    }
    let mut share = Mat::zeros(basis.ncols(), count);
    let mut columns = MatMut::from_column_major_slice_mut(columns, rows, count);
    matmul(
        share.as_mut(),
        Accum::Replace,
        basis.transpose(),
        columns.as_ref(),
        1.0,
        Par::Seq,
    );
    matmul(
        columns.as_mut(),
        Accum::Add,
        basis,
        share.as_ref(),
        -1.0,
        Par::Seq,
    );
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
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
