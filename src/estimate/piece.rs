//! What a row measured, in pieces: axes of its point, its orientation, its distance from an anchor; each in standard deviations.

use super::model::Model;
use crate::effect::Scratch;
use crate::robot::Measurements;
use crate::spatial::Pose;
use crate::statistics::MEDIAN_CHI2;
use nalgebra::{Matrix3, Vector3};

/// Beyond this whitened error length (99.3 % of good pieces of one, two, three axes are below) a piece pulls with constant force.
const HUBER_BY_AXES: [f64; 4] = [f64::INFINITY, 2.7, 3.15, HUBER];
pub(crate) const HUBER: f64 = 3.5;

/// Standard deviations that rows show beyond their own noise.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Unmodelled {
    /// Per axis of a point, m.
    pub point: f64,
    /// About each axis, rad.
    pub turn: f64,
}

/// Turns a row's errors into standard deviations.
#[derive(Clone, Copy)]
pub(crate) enum Weight {
    /// Inverse standard deviation per axis; zero where not measured.
    Axes(Vector3<f64>),
    /// Inverse of the covariance's Cholesky factor.
    Full(Matrix3<f64>),
}

impl Weight {
    /// Of a row's point with `unmodelled` (m per axis) beside its own noise.
    pub fn of(data: &Measurements, row: usize, unmodelled: f64) -> Self {
        let variance = data.sigma[row].map(|sigma| sigma * sigma + unmodelled * unmodelled);
        let measured = |axis: usize| data.sigma[row][axis].is_finite();
        let full = data.spread.as_ref().map(|all| {
            let covariance = all[row] + Matrix3::from_diagonal(&variance);
            if data.whole(row) {
                return covariance;
            }
            // What was not measured stands apart, so that the others are weighted by their own covariance.
            let apart = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
            Matrix3::from_fn(|i, j| if measured(i) && measured(j) { covariance[(i, j)] } else { apart(i, j) })
        });
        match full.and_then(|covariance| covariance.cholesky()).and_then(|factor| factor.l().try_inverse()) {
            Some(inverse) if data.whole(row) => Self::Full(inverse),
            Some(inverse) => Self::Full(Matrix3::from_fn(|i, j| if measured(i) && measured(j) { inverse[(i, j)] } else { 0.0 })),
            None => Self::Axes(variance.map(|value| 1.0 / value.sqrt())),
        }
    }

    /// m (or m per unit) -> standard deviations.
    pub fn apply(&self, error: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Axes(weight) => error.component_mul(weight),
            Self::Full(inverse) => inverse * error,
        }
    }
}

/// A piece of a row.
pub(crate) struct Piece {
    /// Measured - predicted in standard deviations, on the first `axes` lines or, of a point, on those measured.
    pub error: Vector3<f64>,
    pub axes: usize,
    gauge: Gauge,
}

enum Gauge {
    Point(Weight),
    /// 1 / rad.
    Turn(f64),
    /// Unit vector from the anchor, over the standard deviation.
    Distance(Vector3<f64>),
}

/// What is left of an orientation (rad) or a distance (m), and its own variance per axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rest {
    pub turn: bool,
    pub residual: Vector3<f64>,
    pub variance: f64,
}

impl Rest {
    pub fn axes(&self) -> usize {
        if self.turn { 3 } else { 1 }
    }

    fn sigma(&self, beyond: Unmodelled) -> f64 {
        let beyond = if self.turn { beyond.turn } else { beyond.point };
        (self.variance + beyond * beyond).sqrt()
    }

    /// Length in standard deviations.
    pub fn error(&self, beyond: Unmodelled) -> f64 {
        self.residual.norm() / self.sigma(beyond)
    }
}

/// The piece of the point of a row whose residual is `residual`; none where no axis was measured.
pub(crate) fn point(data: &Measurements, row: usize, residual: &Vector3<f64>, beyond: Unmodelled) -> Option<Piece> {
    let axes = data.axes(row);
    let weight = (axes > 0).then(|| Weight::of(data, row, beyond.point))?;
    Some(Piece { error: weight.apply(residual), axes, gauge: Gauge::Point(weight) })
}

/// What is left of the row's orientation, after the stack's `point` of this row.
pub(crate) fn turn(model: &Model, data: &Measurements, row: usize, scratch: &Scratch) -> Option<Rest> {
    let (measured, sigma) = data.turn(row)?;
    let off = measured * model.stack.orientation(&model.robot, scratch).transpose();
    let residual = Pose::new(off, Vector3::zeros()).rotation_vector();
    Some(Rest { turn: true, residual, variance: sigma * sigma })
}

/// What is left of the row's distance, and the unit vector from its anchor, after the stack's `point` of this row.
pub(crate) fn distance(
    model: &Model,
    data: &Measurements,
    row: usize,
    at: &Vector3<f64>,
    scratch: &Scratch,
) -> Option<(Rest, Vector3<f64>)> {
    let measured = data.distance(row)?;
    let reach = model.stack.reach(&model.robot, measured.anchor, at, scratch)?;
    let along = reach.try_normalize(0.0)?;
    let joints = data.spread.as_ref().map_or(0.0, |all| along.dot(&(all[row] * along)));
    let residual = Vector3::new(measured.length - reach.norm(), 0.0, 0.0);
    Some((Rest { turn: false, residual, variance: measured.sigma * measured.sigma + joints }, along))
}

impl Piece {
    pub fn of_turn(rest: &Rest, beyond: Unmodelled) -> Self {
        let weight = 1.0 / rest.sigma(beyond);
        Self { error: rest.residual * weight, axes: rest.axes(), gauge: Gauge::Turn(weight) }
    }

    pub fn of_distance(rest: &Rest, along: &Vector3<f64>, beyond: Unmodelled) -> Self {
        let weight = 1.0 / rest.sigma(beyond);
        Self { error: rest.residual * weight, axes: rest.axes(), gauge: Gauge::Distance(along * weight) }
    }

    /// Root of Huber's weight: the share by which errors and derivatives count.
    pub fn share(&self) -> f64 {
        let (error, bound) = (self.error.norm(), bound(self.axes));
        if error > bound { (bound / error).sqrt() } else { 1.0 }
    }

    /// Derivatives of the predicted piece, in standard deviations per unit of the parameter.
    pub fn derivatives(
        &self,
        model: &Model,
        at: &Vector3<f64>,
        scratch: &mut Scratch,
        mut emit: impl FnMut(usize, Vector3<f64>),
    ) {
        match &self.gauge {
            Gauge::Point(weight) => {
                model.stack.partials(&model.robot, at, scratch, |k, derivative| emit(k, weight.apply(&derivative)));
            }
            Gauge::Turn(weight) => model.stack.turning(&model.robot, scratch, |k, derivative| emit(k, derivative * *weight)),
            Gauge::Distance(along) => model.stack.reaching(&model.robot, at, scratch, |k, derivative| {
                emit(k, Vector3::new(along.dot(&derivative), 0.0, 0.0));
            }),
        }
    }
}

/// Where Huber's loss turns linear for a piece of so many axes.
pub(crate) fn bound(axes: usize) -> f64 {
    HUBER_BY_AXES[axes]
}

pub(crate) fn huber(error: f64, axes: usize) -> f64 {
    let bound = bound(axes);
    if error <= bound { 0.5 * error * error } else { bound * (error - 0.5 * bound) }
}

/// By what a squared error of so many axes is to be multiplied to have the median of three.
pub(crate) fn as_of_three(axes: usize) -> f64 {
    MEDIAN_CHI2[3] / MEDIAN_CHI2[axes]
}
