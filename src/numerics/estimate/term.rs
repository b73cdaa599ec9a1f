//! A term of the problem: what one row measured of one kind, in standard deviations, with Huber's loss.

use crate::effect::PlacedRow;
use crate::observation::{ExcessSigma, MeasurementKind, Residual, Sensitivity};
use crate::robot::Measurements;
use crate::statistics::MEDIAN_CHI2;
use nalgebra::Vector3;

/// Beyond this whitened error length (99.3 % of good terms of one, two, three numbers are below) a term pulls with constant force.
const HUBER_BY_AXES: [f64; 4] = [f64::INFINITY, 2.7, 3.15, HUBER];
pub(crate) const HUBER: f64 = 3.5;

/// Weighted residual and derivatives of one kind in one row.
pub(crate) struct ObservationTerm {
    /// Measured - predicted in standard deviations.
    pub error: Vector3<f64>,
    pub axes: usize,
    sensitivity: Sensitivity,
}

impl ObservationTerm {
    /// With `excess` beside the measurement's own noise. `None` where the row measured none.
    pub fn of(
        kind: &'static dyn MeasurementKind,
        data: &Measurements,
        row: usize,
        placed: &PlacedRow,
        excess: ExcessSigma,
    ) -> Option<(Self, Residual)> {
        let residual = Residual::of(kind, data, row, placed)?;
        let weight = residual.weight(data, excess.of(residual.dimension()));
        let error = weight.apply(&residual.error);
        let sensitivity = residual.sensitivity(data, placed, weight);
        Some((
            Self {
                error,
                axes: residual.axes,
                sensitivity,
            },
            residual,
        ))
    }

    /// Root of Huber's weight: the share by which errors and derivatives count.
    pub fn share(&self) -> f64 {
        share(self.error.norm(), self.axes)
    }

    /// Derivatives of what was predicted, in standard deviations per unit of the parameter.
    pub fn derivatives(&self, placed: &mut PlacedRow, emit: impl FnMut(usize, Vector3<f64>)) {
        self.sensitivity.derivatives(placed, emit);
    }
}

/// Root of Huber's weight of an error of so many axes, in standard deviations.
pub(crate) fn share(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error > bound {
        (bound / error).sqrt()
    } else {
        1.0
    }
}

/// Where Huber's loss turns linear for a term of so many axes.
pub(crate) fn bound(axes: usize) -> f64 {
    HUBER_BY_AXES[axes]
}

pub(crate) fn huber(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error <= bound {
        0.5 * error * error
    } else {
        bound * (error - 0.5 * bound)
    }
}

/// By what a squared error of so many axes is to be multiplied to have the median of three.
pub(crate) fn as_of_three(axes: usize) -> f64 {
    MEDIAN_CHI2[3] / MEDIAN_CHI2[axes]
}
