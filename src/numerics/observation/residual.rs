//! What is left of what a row measured of one kind.

use super::{Dimension, MeasurementKind, RowView, Sensitivity, Weight};
use crate::effect::PlacedRow;
use crate::robot::Measurements;
use nalgebra::Vector3;

/// Standard deviation that rows show beyond their own noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExcessSigma {
    /// Per axis of a point and of other lengths, m.
    pub length: f64,
    /// About each axis, rad.
    pub angle: f64,
}

impl ExcessSigma {
    /// The part of a dimension: m, or rad.
    pub fn of(&self, dimension: Dimension) -> f64 {
        match dimension {
            Dimension::Length => self.length,
            Dimension::Angle => self.angle,
        }
    }
}

/// Measured - predicted of one kind in one row.
#[derive(Clone, Copy)]
pub struct Residual {
    /// What was measured.
    pub kind: &'static dyn MeasurementKind,
    /// The row of the recording.
    pub row: usize,
    /// m or rad, the numbers of the kind; 0 where one was not measured, and beyond them.
    pub error: Vector3<f64>,
    /// How many values were measured.
    pub axes: usize,
    /// Variance of each value, where the kind has one for all.
    variance: f64,
}

impl Residual {
    /// What is left of a row that was placed; `None` as by [`MeasurementKind::residual`].
    pub fn of(
        kind: &'static dyn MeasurementKind,
        data: &Measurements,
        row: usize,
        placed: &PlacedRow,
    ) -> Option<Self> {
        let (error, variance) = kind.residual(RowView { data, row, placed })?;
        Some(Self {
            kind,
            row,
            error,
            axes: kind.axes(data, row),
            variance,
        })
    }

    /// Whether it is a length or an angle.
    pub fn dimension(&self) -> Dimension {
        self.kind.about().dimension
    }

    /// Turns the error into standard deviations, with `excess` (m or rad) beside the noise.
    pub fn weight(&self, data: &Measurements, excess: f64) -> Weight {
        self.kind.weight(data, self.row, self.variance, excess)
    }

    /// The error in standard deviations.
    pub fn whitened(&self, data: &Measurements, excess: f64) -> Vector3<f64> {
        self.weight(data, excess).apply(&self.error)
    }

    /// What the kind sees of the target's motion, in standard deviations by `weight`.
    pub fn sensitivity(
        &self,
        data: &Measurements,
        placed: &PlacedRow,
        weight: Weight,
    ) -> Sensitivity {
        let row = self.row;
        self.kind.sensitivity(RowView { data, row, placed }, weight)
    }
}
