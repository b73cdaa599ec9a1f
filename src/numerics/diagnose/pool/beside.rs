//! New forms judged beside a set of hypotheses and the base model, without a place in the pool.

use super::cholesky::PivotedCholesky;
use super::hypotheses::HypothesisSet;
use super::linear::dot;
use crate::criteria::search::{IDLE, LEVELS};
use crate::effect::{Form, Survey};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Forms that one thread tries at once: fixed, so that no rounding depends on the number of threads.
const FORMS: usize = 4;

/// A set of hypotheses and the base model, beside which forms are tried.
pub(crate) struct Beside<'p, 'a> {
    pool: &'p HypothesisSet<'a>,
    /// Columns of the set that the data see, residual rows x rank.
    columns: Mat<f64>,
    /// Cholesky factor of their Gram matrix.
    lower: Mat<f64>,
    /// What base model and set leave.
    residual: Vec<f64>,
    /// What laws of each joint's travel need of the above.
    travels: Vec<OnceLock<AlongTravel>>,
}

/// Base model, set and residual along a joint's travel: one number for each row of the recording, where the columns have several.
struct AlongTravel {
    base: Mat<f64>,
    columns: Mat<f64>,
    residual: Vec<f64>,
    /// Square of what a unit travel does.
    square: Vec<f64>,
}

impl<'p, 'a> Beside<'p, 'a> {
    pub fn of(pool: &'p HypothesisSet<'a>, set: &[usize]) -> Self {
        let (factor, own) = (pool.factor(set), pool.columns_of(set));
        let mut columns = Mat::zeros(pool.residual_rows, factor.rank());
        for (k, column) in factor.order.iter().enumerate() {
            columns.col_as_slice_mut(k).copy_from_slice(pool.column(own[*column]));
        }
        let coefficients = factor.backward(&factor.forward(|k| pool.gradient[own[k]]));
        let mut residual = pool.residual.clone();
        for (k, coefficient) in coefficients.iter().enumerate() {
            residual.iter_mut().zip(columns.col_as_slice(k)).for_each(|(value, c)| *value -= coefficient * c);
        }
        let travels = (0..pool.problem.robot.joints()).map(|_| OnceLock::new()).collect();
        Self { pool, columns, lower: factor.lower(), residual, travels }
    }

    /// By how much each form would lower the squared residual.
    pub fn gains(&self, forms: &[Form]) -> Vec<f64> {
        forms.par_chunks(FORMS).flat_map_iter(|forms| self.gains_of(forms)).collect()
    }

    /// A form with its shape where it gains most (variable projection).
    pub fn refined(&self, mut form: Form, survey: &Survey) -> Form {
        let mut most = self.gains(std::slice::from_ref(&form))[0];
        let mut idle = 0;
        for level in 0..*LEVELS {
            let near = form.near(survey, level);
            let gains = self.gains(&near);
            match gains.into_iter().zip(near).max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((gain, other)) if gain > most * (1.0 + 1e-9) => (most, form) = (gain, other),
                _ => idle += 1,
            }
            if idle >= *IDLE {
                break;
            }
        }
        form
    }

    fn gains_of(&self, forms: &[Form]) -> Vec<f64> {
        match forms.iter().map(|form| self.pool.problem.plain_travel(form)).collect::<Option<Vec<_>>>() {
            Some(travels) if travels.windows(2).all(|two| two[0].0 == two[1].0) => self.gains_of_travels(&travels),
            _ => self.gains_of_columns(forms),
        }
    }

    /// Gains of laws of the travel of one joint.
    fn gains_of_travels(&self, travels: &[(usize, Vec<f64>)]) -> Vec<f64> {
        let (joint, rows) = (travels[0].0, self.pool.problem.rows.len());
        let along = self.travels[joint].get_or_init(|| self.along(joint));
        let mut all: Vec<f64> = travels.iter().flat_map(|(_, values)| values).copied().collect();
        let mut squared = Vec::with_capacity(all.len());
        for values in all.chunks_mut(rows.max(1)) {
            let square =
                |values: &[f64]| values.iter().zip(&along.square).map(|(value, square)| value * square).collect::<Vec<_>>();
            let norm = dot(values, &square(values)).sqrt().max(1e-300);
            values.iter_mut().for_each(|value| *value /= norm);
            squared.extend(square(values));
        }
        let counts = travels.iter().map(|(_, values)| values.len() / rows.max(1));
        let both = [&all, &squared].map(|columns| MatRef::from_column_major_slice(columns, rows, columns.len() / rows.max(1)));
        self.gains_by(both, [&along.base, &along.columns], &along.residual, counts)
    }

    /// Gains of any forms.
    fn gains_of_columns(&self, forms: &[Form]) -> Vec<f64> {
        let rows = self.pool.residual_rows;
        let (mut all, mut counts) = (Vec::new(), Vec::new());
        for form in forms {
            let columns = self.pool.problem.columns(form);
            counts.push(columns.len() / rows.max(1));
            all.extend(columns);
        }
        for column in all.chunks_mut(rows.max(1)) {
            let norm = dot(column, column).sqrt().max(1e-300);
            column.iter_mut().for_each(|value| *value /= norm);
        }
        let all = MatRef::from_column_major_slice(&all, rows, all.len() / rows.max(1));
        self.gains_by([all, all], [&self.pool.base, &self.columns], &self.residual, counts.into_iter())
    }

    /// Gains by columns of unit length, a form's after another's; products of two are those of `own` and `other`.
    fn gains_by(
        &self,
        [own, other]: [MatRef<'_, f64>; 2],
        [base, columns]: [&Mat<f64>; 2],
        residual: &[f64],
        counts: impl Iterator<Item = usize>,
    ) -> Vec<f64> {
        let by_base = product(base.as_ref(), own);
        let mut by_set = product(columns.as_ref(), own);
        if self.lower.ncols() > 0 {
            solve_lower_triangular_in_place(self.lower.as_ref(), by_set.as_mut(), Par::Seq);
        }
        let mut first = 0;
        let one = |count| {
            let range = first..first + count;
            first += count;
            let parts = [own, other, by_base.as_ref(), by_set.as_ref()].map(|of| of.subcols(range.start, count));
            gain(parts, residual)
        };
        counts.map(one).collect()
    }

    fn along(&self, joint: usize) -> AlongTravel {
        let problem = self.pool.problem;
        let along = |columns: &Mat<f64>| {
            let mut out = Mat::zeros(problem.rows.len(), columns.ncols());
            for k in 0..columns.ncols() {
                out.col_as_slice_mut(k).copy_from_slice(&problem.along_travel(joint, columns.col_as_slice(k)));
            }
            out
        };
        AlongTravel {
            base: along(&self.pool.base),
            columns: along(&self.columns),
            residual: problem.along_travel(joint, &self.residual),
            square: problem.along_travel(joint, problem.unit_travel(joint)),
        }
    }
}

/// By how much columns lower the squared residual: their entries, those that they are multiplied by, and what base model and set take off
/// them.
fn gain([own, other, by_base, by_set]: [MatRef<'_, f64>; 4], residual: &[f64]) -> f64 {
    let count = own.ncols();
    let mut gram = vec![0.0; count * count];
    for i in 0..count {
        for j in 0..=i {
            let product = |of: MatRef<'_, f64>| dot(slice(of, i), slice(of, j));
            gram[i * count + j] = dot(slice(own, i), slice(other, j)) - product(by_base) - product(by_set);
        }
    }
    let factor = PivotedCholesky::of(gram, count);
    factor.forward(|k| dot(slice(own, k), residual)).iter().map(|value| value * value).sum()
}

/// A column of a matrix that is stored column by column.
fn slice(of: MatRef<'_, f64>, k: usize) -> &[f64] {
    of.get(.., k).try_as_col_major().map_or(&[], |column| column.as_slice())
}

/// Transpose of `a` times `b`.
fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut products = Mat::zeros(a.ncols(), b.ncols());
    matmul(products.as_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
    products
}
