//! How far off a row is under a model, in the units of people: a length and an angle.

use super::model::Model;
use crate::effect::{PlacedRow, PlacementBuffers};
use crate::observation::{Dimension, KINDS, Residual};
use crate::robot::Measurements;
use nalgebra::Vector3;
use rayon::prelude::*;

/// How far off a row is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowError {
    /// Measured - predicted along the axes that were measured, m.
    pub point: Vector3<f64>,
    /// Its length, or that of another kind where no axis was measured, m.
    pub length: f64,
    /// Angle between what was measured and predicted of the orientation, rad.
    pub angle: Option<f64>,
}

/// How far off a row is under a model.
pub(crate) fn row_error(
    model: &Model,
    data: &Measurements,
    row: usize,
    scratch: &mut PlacementBuffers,
) -> RowError {
    placed_row_error(data, row, &model.place(data, row, scratch))
}

/// The same of a row whose arm was placed.
pub(crate) fn placed_row_error(data: &Measurements, row: usize, placed: &PlacedRow) -> RowError {
    let (mut length, mut angle) = (None, None);
    for residual in KINDS
        .iter()
        .filter_map(|kind| Residual::of(*kind, data, row, placed))
    {
        let first = match residual.dimension() {
            Dimension::Length => &mut length,
            Dimension::Angle => &mut angle,
        };
        first.get_or_insert_with(|| residual.error.norm());
    }
    RowError {
        point: data.points.residual(row, &placed.point),
        length: length.unwrap_or(0.0),
        angle,
    }
}

impl Model {
    /// What is left of every row, where some row measured other than a whole point; empty where all measured just that.
    pub fn row_errors(&self, data: &Measurements) -> Vec<RowError> {
        let plain = data.readings.is_empty() && (0..data.rows()).all(|row| data.has_point(row));
        let rows = if plain { 0 } else { data.rows() };
        let scratch = || self.stack.scratch(&self.robot);
        (0..rows)
            .into_par_iter()
            .map_init(scratch, |scratch, row| row_error(self, data, row, scratch))
            .collect()
    }
}
