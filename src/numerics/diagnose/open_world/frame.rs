//! The residual without any cause and the columns of whatever moves it, both with geometry projected off.

use crate::diagnose::pool::{orthonormal, project};
use crate::diagnose::round::{FitState, Fitter, RoundView};
use crate::effect::{Form, Motion, Variable};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector};

/// Columns of a group, projected, with their products among each other and with the residual.
pub(super) struct ProjectedColumns {
    /// Residual rows x columns.
    pub columns: DMatrix<f64>,
    /// Mean squared change (m2 or rad2) of what was measured by a unit of each column's coefficient.
    pub square: Vec<f64>,
    pub products: GroupProducts,
}

/// What the evidence of a group needs.
#[derive(Clone)]
pub(super) struct GroupProducts {
    pub gram: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

/// The last model's rows.
pub(super) struct ProjectedRows<'a> {
    pub view: &'a RoundView<'a>,
    base: Mat<f64>,
    /// Without the causes of the model.
    residual: Vec<f64>,
    /// Variance of one number of a row, m2 or rad2, by which columns become sizes.
    variance: Vec<f64>,
}

impl<'a> ProjectedRows<'a> {
    pub fn of(view: &'a RoundView<'a>, now: &FitState, fitter: &Fitter) -> Self {
        let problem = &view.problem;
        let base = orthonormal(&problem.jacobian(fitter.free()));
        let variance = |(i, row): (usize, &usize)| {
            fitter.scale.noise(problem.data, *row).powi(2) / problem.readings_of(i).len().max(1) as f64
        };
        let variance = problem.rows.iter().enumerate().map(variance).collect();
        let mut residual = problem.residual.clone();
        for (cause, range) in now.causes.iter().zip(&now.ranges) {
            let columns = problem.columns(&cause.form);
            for (column, k) in columns.chunks(problem.residual_rows()).zip(range.clone()) {
                residual.iter_mut().zip(column).for_each(|(value, c)| *value += c * now.model.x[k]);
            }
        }
        project(base.as_ref(), &mut residual);
        Self { view, base, residual, variance }
    }

    /// Parameters of the base model.
    pub fn rank(&self) -> usize {
        self.base.ncols()
    }

    pub fn residual_rows(&self) -> usize {
        self.residual.len()
    }

    /// In standard deviations of the rows.
    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    pub fn square(&self) -> f64 {
        self.residual.iter().map(|value| value * value).sum()
    }

    /// GroupProducts of some columns with the residual.
    pub fn along(&self, columns: MatRef<'_, f64>) -> DVector<f64> {
        let residual = MatRef::from_column_major_slice(&self.residual, self.residual.len(), 1);
        product(columns, residual).column(0).into_owned()
    }

    /// A form of the list or of the model.
    pub fn block(&self, form: &Form) -> ProjectedColumns {
        let (columns, square) = self.projected(self.view.problem.motions_by(form));
        self.with_products(columns, square)
    }

    /// Columns of a motion along the functions of a row in `values`, one after another, as they are before [`ProjectedRows::projected`]:
    /// all products of a direction and a function.
    pub fn free(&self, directions: &[Vec<f64>], values: &[Vec<f64>]) -> Vec<f64> {
        let rows = self.residual.len();
        let mut raw = vec![0.0; rows * directions.len() * values.len()];
        for ((direction, value), column) in
            directions.iter().flat_map(|direction| values.iter().map(move |value| (direction, value))).zip(raw.chunks_mut(rows))
        {
            for (i, value) in value.iter().enumerate() {
                self.view.problem.readings_of(i).for_each(|line| column[line] = direction[line] * value);
            }
        }
        raw
    }

    /// Whitened motions of the tool by each direction of a motion.
    pub fn directions(&self, motion: Motion) -> Vec<Vec<f64>> {
        self.view.problem.directions(motion)
    }

    /// A variable at every row; none where some row does not tell.
    pub fn values(&self, of: Variable) -> Option<Vec<f64>> {
        self.view.problem.values(of)
    }

    /// Columns with geometry projected off, and the mean squares of what they were.
    pub fn projected(&self, mut raw: Vec<f64>) -> (DMatrix<f64>, Vec<f64>) {
        let rows = self.residual.len();
        let square = raw.chunks(rows).map(|column| self.mean_square(column)).collect();
        raw.chunks_mut(rows).for_each(|column| self.view.problem.innovate(column));
        project(self.base.as_ref(), &mut raw);
        (DMatrix::from_vec(rows, raw.len() / rows, raw), square)
    }

    /// Projected columns of a group with their products.
    pub fn with_products(&self, columns: DMatrix<f64>, square: Vec<f64>) -> ProjectedColumns {
        let gram = product(view(&columns), view(&columns));
        let gradient = self.along(view(&columns));
        ProjectedColumns { columns, square, products: GroupProducts { gram, gradient } }
    }

    fn mean_square(&self, column: &[f64]) -> f64 {
        let of_row = |(i, variance): (usize, &f64)| {
            let lines = self.view.problem.readings_of(i);
            column[lines].iter().map(|value| value * value).sum::<f64>() * variance
        };
        self.variance.iter().enumerate().map(of_row).sum::<f64>() / self.variance.len().max(1) as f64
    }
}

/// Transpose of `a` times `b`.
pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> DMatrix<f64> {
    let mut products = DMatrix::zeros(a.ncols(), b.ncols());
    let out = MatMut::from_column_major_slice_mut(products.as_mut_slice(), a.ncols(), b.ncols());
    matmul(out, Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    products
}

pub(super) fn view(of: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(of.as_slice(), of.nrows(), of.ncols())
}
