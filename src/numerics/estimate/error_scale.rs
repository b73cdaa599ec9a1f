//! In what errors of rows are compared: lengths where whole points alone were measured, else standard deviations, since lengths and angles
//! have no common size.

use super::model::{Model, placed_row_error};
use crate::effect::{PlacedRow, PlacementBuffers};
use crate::observation::{Dimension, KINDS, Residual, dimension, kinds};
use crate::robot::Measurements;
use rayon::prelude::*;

/// What errors of rows are compared in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ErrorScale {
    /// Lengths of what is left of points, or of other lengths, m.
    Lengths,
    /// Standard deviations of what a row measured, root mean square over its numbers, times the noise.
    Noise {
        /// What the noise is a size of.
        dimension: Dimension,
        /// Length of one sigma, root mean square over the rows, m or rad.
        size: f64,
    },
}

impl ErrorScale {
    /// The scale of errors of some rows of a recording.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        if data.readings.is_empty() && rows.iter().all(|row| data.has_point(*row)) {
            return Self::Lengths;
        }
        let dimension = dimension(data, rows);
        let noise: Vec<f64> = rows
            .iter()
            .filter_map(|row| noise(data, *row, dimension))
            .collect();
        let size = (noise.iter().map(|sigma| sigma * sigma).sum::<f64>()
            / noise.len().max(1) as f64)
            .sqrt();
        Self::Noise { dimension, size }
    }

    /// What errors are sizes of: m, or rad where no length was measured.
    pub fn dimension(&self) -> Dimension {
        match self {
            Self::Lengths => Dimension::Length,
            Self::Noise { dimension, .. } => *dimension,
        }
    }

    /// The size of an error of one standard deviation of a row, m or rad.
    pub fn noise(&self, data: &Measurements, row: usize) -> f64 {
        match self {
            Self::Lengths => data.noise(row),
            Self::Noise { size, .. } => *size,
        }
    }

    /// The error of a row under a model, m or rad.
    pub(crate) fn error(
        &self,
        model: &Model,
        data: &Measurements,
        row: usize,
        scratch: &mut PlacementBuffers,
    ) -> f64 {
        self.of_placed(data, row, &model.place(data, row, scratch))
    }

    /// The error of a row that was placed, m or rad.
    pub(crate) fn of_placed(&self, data: &Measurements, row: usize, placed: &PlacedRow) -> f64 {
        let Self::Noise { size, .. } = self else {
            return placed_row_error(data, row, placed).length;
        };
        let of_row = kinds(data)
            .into_iter()
            .filter_map(|kind| Residual::of(kind, data, row, placed));
        let (square, count) = of_row.fold((0.0, 0), |(square, count), residual| {
            (
                square + residual.whitened(data, 0.0).norm_squared(),
                count + residual.axes,
            )
        });
        (square / f64::from(count.max(1) as u32)).sqrt() * size
    }
}

/// Length of one sigma (m or rad) of the first kind of a dimension that a row measured.
pub fn noise(data: &Measurements, row: usize, of: Dimension) -> Option<f64> {
    KINDS
        .iter()
        .filter(|kind| kind.about().dimension == of)
        .find_map(|kind| kind.noise(data, row))
}

impl Model {
    /// Sizes (m or rad) of what is left of every row, of the first kind of a dimension that it measured.
    pub fn error_sizes(&self, data: &Measurements, of: Dimension) -> Vec<Option<f64>> {
        let kinds: Vec<_> = kinds(data)
            .into_iter()
            .filter(|kind| kind.about().dimension == of)
            .collect();
        let size = |scratch: &mut PlacementBuffers, row: usize| {
            let placed = self.place(data, row, scratch);
            kinds
                .iter()
                .find_map(|kind| Residual::of(*kind, data, row, &placed))
                .map(|residual| residual.error.norm())
        };
        (0..data.rows())
            .into_par_iter()
            .map_init(|| self.stack.scratch(&self.robot), size)
            .collect()
    }
}
