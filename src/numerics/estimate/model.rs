//! A robot with effects and the values of their parameters: what is identified, predicts, and is compensated by.

use super::known::{Known, KnownLength};
use crate::effect::{BasePlacement, EffectStack, PlacedRow, PlacementBuffers, names};
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
    /// What is known of some parameters beforehand, by position in the stack.
    pub known: BTreeMap<usize, Known>,
    /// Lengths between anchors that are known from elsewhere.
    pub lengths: Vec<KnownLength>,
}

impl Model {
    /// The model with all parameters zero: the nominal robot.
    pub fn nominal(robot: RobotModel, stack: EffectStack) -> Self {
        let x = vec![0.0; stack.specs().len()];
        Self {
            robot,
            stack: Arc::new(stack),
            x,
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
