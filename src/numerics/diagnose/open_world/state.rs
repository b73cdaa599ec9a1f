//! What is in the model, as a part of the covariance of the rows: the rest is seen through its inverse.
//!
//! With columns Z of unit prior variance and noise variance 1/s: X' C^-1 X = s X'X - Y'Y, Y = L^-1 s Z'X, L L' = 1 + s Z'Z.

use super::frame::{GroupProducts, ProjectedColumns, ProjectedRows, product, view};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Causes and free forms under their priors.
#[derive(Clone)]
pub(super) struct KnownCauses {
    /// The columns of the model's causes that are in it, by their numbers, with the roots of their prior variances.
    picked: Vec<(usize, f64)>,
    /// All of its columns times the roots of their prior variances, the picked ones first; residual rows x count.
    columns: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
    along: DVector<f64>,
    /// Over the variance of the noise, in the variances of the rows.
    scale: f64,
}

impl KnownCauses {
    /// Of some of the model's causes, whose columns are `all`, and noise.
    pub fn of(frame: &ProjectedRows, all: &DMatrix<f64>, picked: Vec<(usize, f64)>, scale: f64) -> Self {
        let mut columns = DMatrix::zeros(frame.residual_rows(), picked.len());
        for (mut own, (k, root)) in columns.column_iter_mut().zip(&picked) {
            own.axpy(*root, &all.column(*k), 0.0);
        }
        Self { picked, columns, factor: None, along: DVector::zeros(0), scale }.factored(frame)
    }

    /// With more columns of these prior variances.
    pub fn with(&self, frame: &ProjectedRows, columns: &DMatrix<f64>, variances: &[f64]) -> Self {
        let old = self.columns.ncols();
        let mut all = self.columns.clone().resize_horizontally(old + columns.ncols(), 0.0);
        for (j, variance) in variances.iter().enumerate() {
            all.column_mut(old + j).axpy(variance.sqrt(), &columns.column(j), 0.0);
        }
        Self { columns: all, ..self.clone() }.factored(frame)
    }

    fn factored(mut self, frame: &ProjectedRows) -> Self {
        let count = self.columns.ncols();
        let gram = product(view(&self.columns), view(&self.columns));
        self.factor = Cholesky::new(DMatrix::identity(count, count) + gram * self.scale).filter(|_| count > 0);
        self.along = frame.along(view(&self.columns)) * self.scale;
        if let Some(factor) = &self.factor {
            factor.l_dirty().solve_lower_triangular_mut(&mut self.along);
        }
        self
    }

    /// The products of any columns beside the state.
    pub fn of_columns(&self, frame: &ProjectedRows, columns: &DMatrix<f64>) -> GroupProducts {
        let columns = view(columns);
        let (mut gram, mut gradient) = (product(columns, columns) * self.scale, frame.along(columns) * self.scale);
        if let Some(factor) = &self.factor {
            let mut share = product(view(&self.columns), columns) * self.scale;
            factor.l_dirty().solve_lower_triangular_mut(&mut share);
            gram.gemm_tr(-1.0, &share, &share, 1.0);
            gradient.gemv_tr(-1.0, &share, &self.along, 1.0);
        }
        GroupProducts { gram, gradient }
    }

    /// What the state leaves of the residual, in standard deviations of the noise times the root of `scale`.
    pub fn leaves(&self, frame: &ProjectedRows) -> Vec<f64> {
        let mut left = DVector::from_column_slice(frame.residual());
        if let Some(factor) = &self.factor {
            let mut along = self.along.clone();
            factor.l_dirty().tr_solve_lower_triangular_mut(&mut along);
            left.gemv(-1.0, &self.columns, &along, 1.0);
        }
        left *= self.scale.sqrt();
        left.data.into()
    }

    /// ln of the evidence over that of noise alone.
    pub fn log(&self) -> f64 {
        let determinant =
            self.factor.as_ref().map_or(0.0, |factor| factor.l_dirty().diagonal().iter().map(|value| value.ln()).sum());
        0.5 * self.gain() - determinant
    }

    /// What the squared residual, over the noise, falls by.
    pub fn gain(&self) -> f64 {
        self.along.norm_squared()
    }

    /// A group's products beside the state; `known` are those of the columns of all the model's causes with the group's.
    pub fn beside(&self, block: &ProjectedColumns, known: &DMatrix<f64>) -> GroupProducts {
        let (mut gram, mut gradient) = (&block.products.gram * self.scale, &block.products.gradient * self.scale);
        let Some(factor) = &self.factor else { return GroupProducts { gram, gradient } };
        let (picked, count) = (self.picked.len(), self.columns.ncols());
        let mut share = DMatrix::zeros(count, gram.ncols());
        for (i, (k, root)) in self.picked.iter().enumerate() {
            share.row_mut(i).copy_from(&(known.row(*k) * (root * self.scale)));
        }
        if count > picked {
            let more = product(view(&self.columns).subcols(picked, count - picked), view(&block.columns));
            share.rows_mut(picked, count - picked).copy_from(&(more * self.scale));
        }
        factor.l_dirty().solve_lower_triangular_mut(&mut share);
        gram.gemm_tr(-1.0, &share, &share, 1.0);
        gradient.gemv_tr(-1.0, &share, &self.along, 1.0);
        GroupProducts { gram, gradient }
    }
}
