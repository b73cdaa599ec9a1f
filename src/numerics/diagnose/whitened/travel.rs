//! Columns of laws of a joint's travel: functions of the row times what a unit travel of the joint does. Most hypotheses are such, and
//! their columns and products follow from one number a row.

use super::WhitenedProblem;
use crate::effect::{Basis, Form, Law, Motion, Term, Unknown, Variable};

impl WhitenedProblem<'_> {
    /// The joint that a form makes travel, and the values of its functions, one after another, a number each row; none where the form does
    /// anything else.
    pub(super) fn travel(&self, form: &Form) -> Option<(usize, Vec<f64>)> {
        let term = form.term()?;
        let joint = term.motion().travels()?;
        let rows = self.rows.len();
        let mut values = vec![0.0; term.law().count() * rows];
        for (i, motion) in self.motions.iter().enumerate() {
            motion.law(self.robot, self.data, term.law(), |k, value| {
                values[k * rows + i] += value
            });
        }
        Some((joint, values))
    }

    /// The same where every residual row says what it says by itself.
    pub(crate) fn plain_travel(&self, form: &Form) -> Option<(usize, Vec<f64>)> {
        if self.innovations.is_some() {
            None
        } else {
            self.travel(form)
        }
    }

    /// Column of a unit travel of a joint, whether noise is correlated or not.
    pub(crate) fn unit_travel(&self, joint: usize) -> &[f64] {
        let column = |joint: usize| {
            // One in every row, and the angle, which is not asked.
            let law = Law::new(
                Variable::Angle { joint },
                Basis::Straight {
                    zero: 0.0,
                    per: 1.0,
                },
            );
            let mut columns =
                self.motions_by_partials(&Term::new(&Unknown, Motion::Joint { joint }, law).into());
            columns.truncate(self.residual_rows());
            columns
        };
        &self
            .travels
            .get_or_init(|| (0..self.robot.joints()).map(column).collect())[joint]
    }

    /// Columns of functions of a joint's travel, one after another.
    pub(super) fn travelled(&self, joint: usize, values: &[f64]) -> Vec<f64> {
        let unit = self.unit_travel(joint);
        let mut out = Vec::with_capacity(values.len() / self.rows.len().max(1) * unit.len());
        for values in values.chunks(self.rows.len().max(1)) {
            out.extend(
                unit.iter()
                    .enumerate()
                    .map(|(residual_row, unit)| unit * values[self.row_of(residual_row)]),
            );
        }
        out
    }

    /// Sums, row by row, of the products of a column with that of a unit travel of a joint.
    pub(crate) fn along_travel(&self, joint: usize, column: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.rows.len()];
        for (residual_row, (value, unit)) in column.iter().zip(self.unit_travel(joint)).enumerate()
        {
            out[self.row_of(residual_row)] += value * unit;
        }
        out
    }
}
