//! A robot with effects and the values of their parameters: what is identified, predicts, and is compensated by.

use crate::effect::{BasePlacement, EffectStack, PlacedRow, PlacementBuffers, names};
use crate::observation::{Dimension, KINDS, Residual};
use crate::robot::{Measurements, RobotModel};
use crate::spatial::Pose;
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The forward model of measured points.
#[derive(Clone)]
pub struct Model {
    /// The nominal arm, with targets and anchors.
    pub robot: RobotModel,
    /// What moves it off nominal.
    pub stack: Arc<EffectStack>,
    /// Parameter values, SI, in the order of the stack's specs.
    pub x: Vec<f64>,
    /// One standard deviation of each parameter before any measurement, SI: that of its spec, or wider where this arm is made worse.
    pub tolerances: Vec<f64>,
    /// What else is known of some parameters beforehand, by position in the stack; a prior stands in the tolerance's place.
    pub known: BTreeMap<usize, Known>,
    /// Lengths between anchors that are known from elsewhere.
    pub lengths: Vec<KnownLength>,
}

impl Model {
    /// The model with all parameters zero: the nominal robot.
    pub fn nominal(robot: RobotModel, stack: EffectStack) -> Self {
        let x = vec![0.0; stack.specs().len()];
        let tolerances = stack.specs().iter().map(|spec| spec.tolerance).collect();
        Self {
            robot,
            stack: Arc::new(stack),
            x,
            tolerances,
            known: BTreeMap::new(),
            lengths: Vec::new(),
        }
    }

    /// Where the base stands in the tracker's frame, corrections included.
    pub fn base(&self) -> Pose {
        self.stack
            .effects()
            .find(|(effect, _)| effect.name() == names::BASE_FRAME)
            .map_or(*self.stack.base(), |(_, range)| {
                BasePlacement::new(*self.stack.base()).pose(&self.x[range])
            })
    }

    /// The same model with every law held at the ends of what these rows have of its variables: beyond, nothing was fitted.
    pub fn held_within(&self, data: &Measurements, rows: &[usize]) -> Self {
        let stack = self.stack.held_within(&self.robot, data, rows, &self.x);
        Self {
            stack: Arc::new(stack),
            ..self.clone()
        }
    }

    /// Places the arm of a row.
    pub(crate) fn place<'a>(
        &'a self,
        data: &Measurements,
        row: usize,
        scratch: &'a mut PlacementBuffers,
    ) -> PlacedRow<'a> {
        self.stack.place(&self.robot, data, row, &self.x, scratch)
    }

    /// Measured points (m, tracker frame) of every row.
    pub fn predict(&self, data: &Measurements) -> Vec<Vector3<f64>> {
        (0..data.rows())
            .into_par_iter()
            .map_init(
                || self.stack.scratch(&self.robot),
                |scratch, row| self.stack.point(&self.robot, data, row, &self.x, scratch),
            )
            .collect()
    }
}

/// Beforehand about one parameter, SI.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    /// A normal distribution, if any.
    pub prior: Option<Prior>,
    /// A range, if any.
    pub bounds: Option<Bounds>,
}

/// A normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// SI.
    pub mean: f64,
    /// Above zero.
    pub sigma: f64,
}

/// Both ends belong to what is allowed; `low < high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// SI.
    pub low: f64,
    /// SI.
    pub high: f64,
}

/// A distance between two sockets, planes, spheres (their centres) or ends of distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownLength {
    /// By their numbers in the robot's setup, two different ones.
    pub between: [usize; 2],
    /// m
    pub length: f64,
    /// m, above zero.
    pub sigma: f64,
}

/// What a prior and the data say of one parameter, after a fit with both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorCheck {
    /// As it was stated.
    pub prior: Prior,
    /// Estimate and standard deviation without this prior, SI; `None` where the data alone say nothing.
    pub without: Option<(f64, f64)>,
    /// Distance of the two in standard deviations of their difference.
    pub conflict: f64,
}

/// A prior and data farther apart than this many standard deviations contradict each other.
pub const CONFLICT: f64 = 3.0;

impl PriorCheck {
    /// From the estimate and its variance with the prior: the prior's information taken off again.
    pub(crate) fn of(prior: Prior, estimate: f64, variance: f64) -> Self {
        let (prior_variance, off) = (prior.sigma * prior.sigma, estimate - prior.mean);
        let gained = prior_variance - variance;
        // The data's share of the information is gained / prior variance: smaller, it is rounding.
        if gained <= 1e-6 * prior_variance {
            return Self {
                prior,
                without: None,
                conflict: 0.0,
            };
        }
        let without = (
            prior.mean + off * prior_variance / gained,
            (variance * prior_variance / gained).sqrt(),
        );
        Self {
            prior,
            without: Some(without),
            conflict: off.abs() / gained.sqrt(),
        }
    }
}

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

/// How far off a row is whose arm was placed.
pub(crate) fn row_error(data: &Measurements, row: usize, placed: &PlacedRow) -> RowError {
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
    /// The residual of every row, where some row measured other than a whole point; empty where all measured just that.
    pub fn row_errors(&self, data: &Measurements) -> Vec<RowError> {
        let plain = data.readings.is_empty() && (0..data.rows()).all(|row| data.has_point(row));
        let rows = if plain { 0 } else { data.rows() };
        let scratch = || self.stack.scratch(&self.robot);
        let error = |scratch: &mut PlacementBuffers, row| {
            row_error(data, row, &self.place(data, row, scratch))
        };
        (0..rows).into_par_iter().map_init(scratch, error).collect()
    }
}
