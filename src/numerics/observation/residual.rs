//! What is left of what a row measured of one kind.

use super::{Dimension, MeasurementKind, RowView, Sensitivity};
use crate::effect::PlacedRow;
use crate::robot::Measurements;
use nalgebra::{Matrix3, Vector3};

/// Standard deviation that rows show beyond their own noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ExcessSigma {
    /// Per axis of a point and of other lengths, m.
    pub(crate) length: f64,
    /// About each axis, rad.
    pub(crate) angle: f64,
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
    pub(crate) row: usize,
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

/// Turns an error or a derivative (m or rad, three axes) into standard deviations.
#[derive(Debug, Clone, Copy)]
pub enum Weight {
    /// The same inverse standard deviation of all numbers.
    Uniform(f64),
    /// Inverse standard deviation per axis; zero where not measured.
    Axes(Vector3<f64>),
    /// A matrix, e.g. the inverse of the covariance's Cholesky factor.
    Full(Matrix3<f64>),
    /// The share along a direction alone, on the first line.
    Along(Vector3<f64>),
}

impl Weight {
    /// The same standard deviation of all axes.
    pub fn uniform(sigma: f64) -> Self {
        Self::Uniform(1.0 / sigma)
    }

    /// The weight of a row's point with `excess` (m per axis) in addition to its noise.
    pub fn of(data: &Measurements, row: usize, excess: f64) -> Self {
        let variance = data.points.sigma[row].map(|sigma| sigma * sigma + excess * excess);
        let measured = |axis: usize| data.points.has(row, axis);
        let full = data.spread.as_ref().map(|all| {
            let covariance = all[row] + Matrix3::from_diagonal(&variance);
            if data.has_point(row) {
                return covariance;
            }
            // What was not measured stands apart, so that the others are weighted by their own covariance.
            let apart = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
            Matrix3::from_fn(|i, j| {
                if measured(i) && measured(j) {
                    covariance[(i, j)]
                } else {
                    apart(i, j)
                }
            })
        });
        match full
            .and_then(|covariance| covariance.cholesky())
            .and_then(|factor| factor.l().try_inverse())
        {
            Some(inverse) if data.has_point(row) => Self::Full(inverse),
            Some(inverse) => Self::Full(Matrix3::from_fn(|i, j| {
                if measured(i) && measured(j) {
                    inverse[(i, j)]
                } else {
                    0.0
                }
            })),
            None => Self::Axes(variance.map(|value| 1.0 / value.sqrt())),
        }
    }

    /// The same of what is a matrix times the motion that it is applied to.
    pub(super) fn after(&self, lines: &Matrix3<f64>) -> Self {
        let weighted = [0, 1, 2].map(|axis: usize| self.apply(&lines.column(axis).into_owned()));
        Self::Full(Matrix3::from_columns(&weighted))
    }

    /// An error or a derivative in standard deviations.
    pub fn apply(&self, error: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Uniform(weight) => error * *weight,
            Self::Axes(weight) => error.component_mul(weight),
            Self::Full(inverse) => inverse * error,
            Self::Along(direction) => Vector3::new(direction.dot(error), 0.0, 0.0),
        }
    }
}
