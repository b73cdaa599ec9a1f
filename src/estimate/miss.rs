//! How far off rows are under a model, whatever they measured.

use super::model::Model;
use super::piece::{distance, turn};
use crate::effect::Scratch;
use crate::robot::Measurements;
use nalgebra::Vector3;
use rayon::prelude::*;

/// How far off a row is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Miss {
    /// Measured - predicted along the axes that were measured, m.
    pub point: Vector3<f64>,
    /// Its length, or that of the distance where no axis was measured, m.
    pub length: f64,
    /// Angle between measured and predicted orientation, rad.
    pub turn: Option<f64>,
}

/// How far off a row is under a model.
pub(crate) fn miss(model: &Model, data: &Measurements, row: usize, scratch: &mut Scratch) -> Miss {
    let at = model.stack.point(&model.robot, data, row, &model.x, scratch);
    let point = data.residual(row, &at);
    let distance = (data.axes(row) == 0).then(|| distance(model, data, row, &at, scratch)).flatten();
    let turn = turn(model, data, row, scratch).map(|rest| rest.residual.norm());
    Miss { point, length: distance.map_or_else(|| point.norm(), |(rest, _)| rest.residual.norm()), turn }
}

impl Model {
    /// What is left of every row, where some row measured other than a whole point; empty where all measured just that.
    pub fn misses(&self, data: &Measurements) -> Vec<Miss> {
        let plain = data.turn.is_none() && data.distance.is_none() && (0..data.rows()).all(|row| data.whole(row));
        let rows = if plain { 0 } else { data.rows() };
        let scratch = || self.stack.scratch(&self.robot);
        (0..rows).into_par_iter().map_init(scratch, |scratch, row| miss(self, data, row, scratch)).collect()
    }
}
