//! Least squares on one form at a time given a model, which takes its part of the rows first (Frisch, Waugh, Lovell): a coefficient on what
//! the model cannot absorb is the one that a joint fit with it would give.

use crate::criteria::search::{IDLE, LEVELS};
use crate::effect::{Form, Survey};
use crate::linear::{dot, product, project, scale, subtract, view};
use crate::whitened::WhitenedProblem;
use faer::{Mat, MatRef};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;
use std::sync::OnceLock;

/// A remainder of a squared column of unit length below this is rounding and second order.
const INVISIBLE: f64 = 1e-6;

/// Rows, and what a model leaves of them.
pub(super) struct FormRegression<'p, 'a> {
    problem: &'p WhitenedProblem<'a>,
    rows: ModelledRows,
    /// The same by each joint's travel.
    travels: Vec<OnceLock<ModelledRows>>,
    /// Squared residual.
    pub(crate) square: f64,
}

/// What a model can absorb of some numbers a column, and what it leaves of the residual.
struct ModelledRows {
    /// Columns of an orthonormal basis.
    basis: DMatrix<f64>,
    residual: Vec<f64>,
    /// Of laws of a joint's travel, one number for each row of the recording: the square of what a unit travel does there.
    square: Option<Vec<f64>>,
}

/// The coefficients of a form.
pub(super) struct Solution {
    /// By which the squared residual falls.
    pub(crate) gain: f64,
    /// How many of its numbers the data see.
    pub(crate) rank: usize,
    /// SI.
    pub(crate) coefficients: Vec<f64>,
}

impl<'p, 'a> FormRegression<'p, 'a> {
    /// `base` is an orthonormal basis of what the model can do, which has `forms` besides; `residual` is what it leaves without these.
    pub(crate) fn new(
        problem: &'p WhitenedProblem<'a>,
        base: &Mat<f64>,
        forms: &[&Form],
        residual: &[f64],
    ) -> Self {
        let mut residual = residual.to_vec();
        project(base.as_ref(), &mut residual);
        let count = residual.len();
        let mut basis: Vec<f64> = (0..base.ncols())
            .flat_map(|j| base.col_as_slice(j).iter().copied())
            .collect();
        let columns: Vec<f64> = forms
            .iter()
            .flat_map(|form| problem.columns(form))
            .collect();
        for column in columns.chunks(count.max(1)) {
            let mut column = column.to_vec();
            scale(&mut column);
            // Twice: what rounding leaves of a long basis.
            for _ in 0..2 {
                let known = basis.len() / count;
                project(
                    MatRef::from_column_major_slice(&basis, count, known),
                    &mut column,
                );
            }
            if scale(&mut column).powi(2) > INVISIBLE {
                subtract(&mut residual, &column);
                basis.extend(column);
            }
        }
        let known = basis.len() / count.max(1);
        let basis = DMatrix::from_vec(count, known, basis);
        let travels = (0..problem.robot.joints())
            .map(|_| OnceLock::new())
            .collect();
        let square = dot(&residual, &residual);
        Self {
            problem,
            rows: ModelledRows {
                basis,
                residual,
                square: None,
            },
            travels,
            square,
        }
    }

    /// How many numbers the rows measured.
    pub(crate) fn rows(&self) -> usize {
        self.rows.residual.len()
    }

    /// The fit of one form.
    pub(crate) fn solve(&self, form: &Form) -> Solution {
        match self.problem.plain_travel(form) {
            Some((joint, values)) => self.travels[joint]
                .get_or_init(|| self.along(joint))
                .solve(values),
            None => self.rows.solve(self.problem.columns(form)),
        }
    }

    /// By how much each form would lower the squared residual.
    pub(crate) fn gains(&self, forms: &[Form]) -> Vec<f64> {
        forms.par_iter().map(|form| self.solve(form).gain).collect()
    }

    /// A form with its shape where it gains most (variable projection).
    pub(crate) fn refined(&self, mut form: Form, survey: &Survey) -> Form {
        let mut most = self.solve(&form).gain;
        let mut idle = 0;
        for level in 0..*LEVELS {
            let near = form.near(survey, level);
            let gains = self.gains(&near);
            let best = gains.into_iter().zip(near);
            match best.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((gain, other)) if gain > most * (1.0 + 1e-9) => (most, form) = (gain, other),
                _ => idle += 1,
            }
            if idle >= *IDLE {
                break;
            }
        }
        form
    }

    fn along(&self, joint: usize) -> ModelledRows {
        let along = |column: &[f64]| self.problem.along_travel(joint, column);
        let basis = &self.rows.basis;
        let columns: Vec<f64> = basis
            .as_slice()
            .chunks(basis.nrows().max(1))
            .flat_map(along)
            .collect();
        let rows = columns.len() / basis.ncols().max(1);
        ModelledRows {
            basis: DMatrix::from_vec(rows, basis.ncols(), columns),
            residual: along(&self.rows.residual),
            square: Some(along(self.problem.unit_travel(joint))),
        }
    }
}

impl ModelledRows {
    /// The fit of columns, one after another.
    fn solve(&self, mut stacked: Vec<f64>) -> Solution {
        let rows = self.residual.len().max(1);
        let weighed = |column: &[f64]| -> Vec<f64> {
            let Some(square) = &self.square else {
                return column.to_vec();
            };
            let each = column.iter().zip(square);
            each.map(|(value, square)| value * square).collect()
        };
        let scales: Vec<f64> = stacked
            .chunks_mut(rows)
            .map(|column| {
                let length = dot(column, &weighed(column)).sqrt().max(1e-300);
                column.iter_mut().for_each(|value| *value /= length);
                length
            })
            .collect();
        let columns: Vec<&[f64]> = stacked.chunks(rows).collect();
        let absorbed = product(
            view(&self.basis),
            MatRef::from_column_major_slice(&stacked, rows, columns.len()),
        );
        let absorbed =
            |k: usize| &absorbed.as_slice()[k * self.basis.ncols()..(k + 1) * self.basis.ncols()];
        let mut gram = DMatrix::zeros(columns.len(), columns.len());
        for (i, column) in columns.iter().enumerate() {
            let weighed = weighed(column);
            for j in 0..=i {
                gram[(i, j)] = dot(&weighed, columns[j]) - dot(absorbed(i), absorbed(j));
                gram[(j, i)] = gram[(i, j)];
            }
        }
        let along = columns.iter().map(|column| dot(column, &self.residual));
        let along = DVector::from_iterator(columns.len(), along);
        let SymmetricEigen {
            eigenvectors,
            eigenvalues,
        } = gram.symmetric_eigen();
        let along = eigenvectors.tr_mul(&along);
        let seen: Vec<usize> = (0..columns.len())
            .filter(|k| eigenvalues[*k] > INVISIBLE)
            .collect();
        let coefficient = |k: usize| {
            let parts = seen.iter();
            let parts = parts.map(|i| eigenvectors[(k, *i)] * along[*i] / eigenvalues[*i]);
            parts.sum::<f64>() / scales[k]
        };
        Solution {
            gain: seen
                .iter()
                .map(|i| along[*i].powi(2) / eigenvalues[*i])
                .sum(),
            rank: seen.len(),
            coefficients: (0..columns.len()).map(coefficient).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_beside_a_model_is_the_joint_one_and_what_is_invisible_is_left_out() {
        // y = 3 a - 2 b + 0.5 c, where the model absorbs a, and d = b + c is not seen given b and c.
        let column = |k: usize| -> Vec<f64> {
            (0..9)
                .map(|i| ((3 * i + 5 * k * k + 2 * i * k) % 7) as f64 / 7.0 - 0.4)
                .collect()
        };
        let (mut a, b, c) = (column(0), column(1), column(2));
        let y: Vec<f64> = (0..9)
            .map(|i| 3.0 * a[i] - 2.0 * b[i] + 0.5 * c[i])
            .collect();
        scale(&mut a);
        let mut residual = y.clone();
        subtract(&mut residual, &a);
        let rows = ModelledRows {
            basis: DMatrix::from_vec(9, 1, a),
            residual: residual.clone(),
            square: None,
        };
        let found = rows.solve([b.clone(), c.clone()].concat());
        assert!(
            (found.coefficients[0] + 2.0).abs() < 1e-9
                && (found.coefficients[1] - 0.5).abs() < 1e-9
        );
        assert!(found.rank == 2 && (found.gain - dot(&residual, &residual)).abs() < 1e-9);
        let d: Vec<f64> = b.iter().zip(&c).map(|(b, c)| b + c).collect();
        let again = rows.solve([b, c, d].concat());
        assert!(
            again.rank == 2 && (again.gain - found.gain).abs() < 1e-9,
            "{}",
            again.rank
        );
    }
}
