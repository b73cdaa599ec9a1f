//! The recording as the present model sees it: whitened residuals, and how any form of an effect would move them.

use crate::effect::{Deflection, Effect, Form, Sight};
use crate::estimate::{Model, Weight};
use crate::robot::{Measurements, RobotModel};
use faer::Mat;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Fitted rows through the present model. Lines: three a row, in order of rows, in standard deviations.
pub(crate) struct Lens<'a> {
    pub robot: &'a RobotModel,
    pub data: &'a Measurements,
    /// Rows of the recording, ascending.
    pub rows: &'a [usize],
    sights: Vec<Sight>,
    weights: Vec<Weight>,
    /// Whitened measured - predicted.
    pub residual: Vec<f64>,
}

impl<'a> Lens<'a> {
    pub fn new(model: &'a Model, data: &'a Measurements, rows: &'a [usize]) -> Self {
        let sights: Vec<Sight> = rows
            .par_iter()
            .map_init(
                || model.stack.scratch(&model.robot),
                |scratch, row| model.stack.sight(&model.robot, data, *row, &model.x, scratch),
            )
            .collect();
        let weights: Vec<Weight> = rows.iter().map(|row| Weight::of(data, *row, 0.0)).collect();
        let residual = sights.iter().zip(&weights).zip(rows);
        let residual = residual.flat_map(|((sight, weight), row)| {
            weight.apply(&(data.position[*row] - sight.point)).into_iter().copied().collect::<Vec<_>>()
        });
        Self { robot: &model.robot, data, rows, residual: residual.collect(), sights, weights }
    }

    pub fn lines(&self) -> usize {
        3 * self.rows.len()
    }

    /// Load torques (Nm), row-major.
    pub fn torques(&self) -> Vec<f64> {
        self.sights.iter().flat_map(|sight| sight.posture.torque.iter().copied()).collect()
    }

    /// Motion of each row's point by each joint, m/rad; row-major.
    pub fn by_joint(&self, row: usize) -> &[Vector3<f64>] {
        &self.sights[row].by_joint
    }

    /// Columns of a form, `lines` each, one after another.
    pub fn columns(&self, form: &Form) -> Vec<f64> {
        let count = form.parameters(self.robot).len();
        let zeros = vec![0.0; count];
        let lines = self.lines();
        let mut out = vec![0.0; count * lines];
        let mut buffer = Deflection::new(self.robot.joints());
        for (i, (sight, weight)) in self.sights.iter().zip(&self.weights).enumerate() {
            sight.derivatives(self.robot, self.data, form, &zeros, &mut buffer, |parameter, derivative| {
                let derivative = weight.apply(&derivative);
                for axis in 0..3 {
                    out[parameter * lines + 3 * i + axis] += derivative[axis];
                }
            });
        }
        out
    }

    /// Columns of some parameters of the model itself.
    pub fn jacobian(&self, model: &Model, free: &[usize]) -> Mat<f64> {
        let mut column = vec![None; model.stack.specs().len()];
        for (j, parameter) in free.iter().enumerate() {
            column[*parameter] = Some(j);
        }
        let mut out = Mat::zeros(self.lines(), free.len());
        let mut scratch = model.stack.scratch(&model.robot);
        for (i, (row, weight)) in self.rows.iter().zip(&self.weights).enumerate() {
            model.stack.derivatives(&model.robot, self.data, *row, &model.x, &mut scratch, |parameter, derivative| {
                if let Some(j) = column[parameter] {
                    let derivative = weight.apply(&derivative);
                    for axis in 0..3 {
                        out[(3 * i + axis, j)] += derivative[axis];
                    }
                }
            });
        }
        out
    }
}
