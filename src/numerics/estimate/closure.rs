//! Joints at which everything closes: what such data show is counted there.
//!
//! With the residuals left in, the scale of the arm and rotations of the cell look seen, by as much as the points scatter: the scatter
//! of an arm that is a little smaller is a little smaller.

use super::factor::TriangularFactor;
use super::model::Model;
use super::problem::Problem;
use crate::observation::{RowView, contacts, kinds};
use crate::robot::Measurements;

/// Steps towards joints that close; each squares what is left of the error.
const STEPS: usize = 12;
/// m; nothing is left.
const CLOSED: f64 = 1e-14;

impl Problem<'_> {
    /// The data of all candidates from joints at which all contacts close; none where there is none.
    pub fn shown(&self, model: &Model, candidates: &[usize]) -> Option<TriangularFactor> {
        let data = closed(model, self.data, self.rows)?;
        Some(
            Problem {
                data: &data,
                ..*self
            }
            .observe(model, candidates)
            .factor,
        )
    }
}

/// The measurements with joints that close in these rows; none where no row is a contact.
pub(super) fn closed(model: &Model, data: &Measurements, rows: &[usize]) -> Option<Measurements> {
    if !kinds(data).iter().any(|kind| kind.is_contact()) {
        return None;
    }
    let mut out = data.clone();
    let mut scratch = model.stack.scratch(&model.robot);
    for row in rows {
        for (kind, _) in contacts(data, *row) {
            for _ in 0..STEPS {
                let mut placed = model.place(&out, *row, &mut scratch);
                let at = RowView {
                    data: &out,
                    row: *row,
                    placed: &placed,
                };
                let error = kind.residual(at).map(|(error, _)| error);
                let error = error.filter(|error| error.norm() > CLOSED);
                let closing = kind.closing(at);
                let Some(step) = closing
                    .zip(error)
                    .and_then(|(closing, error)| placed.closing_step(&closing, &error))
                else {
                    break;
                };
                let joints = &mut out.q[row * data.joints..(row + 1) * data.joints];
                joints
                    .iter_mut()
                    .zip(step)
                    .for_each(|(q, change)| *q += change);
            }
        }
    }
    Some(out)
}
