//! The calibration problem: weighted position residuals of some rows under some free parameters.

use super::factor::Factor;
use super::model::Model;
use crate::robot::Measurements;
use faer::Mat;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Rows of the recording handled at once: fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 64;

/// Beyond this whitened error length (three axes, one sigma each: 99.3 % of good rows are below) a row pulls with constant force.
pub(crate) const HUBER: f64 = 3.5;

/// What is fitted to what: residual rows (measured - predicted) / sigma with Huber's weights.
pub(crate) struct Problem<'a> {
    pub data: &'a Measurements,
    /// Rows of the recording to fit.
    pub rows: &'a [usize],
    /// Standard deviation per axis added to the instrument's, m: what the model does not explain.
    pub unmodelled: f64,
}

impl Problem<'_> {
    /// Inverse standard deviation per axis.
    fn weight(&self, row: usize) -> Vector3<f64> {
        self.data.sigma[row].map(|sigma| 1.0 / (sigma * sigma + self.unmodelled * self.unmodelled).sqrt())
    }

    /// Measured - predicted of every row (m), in the order of `rows`.
    pub fn residuals(&self, model: &Model) -> Vec<Vector3<f64>> {
        self.rows
            .par_iter()
            .with_min_len(CHUNK)
            .map_init(
                || model.stack.scratch(&model.robot),
                |scratch, &row| self.data.position[row] - model.stack.point(&model.robot, self.data, row, &model.x, scratch),
            )
            .collect()
    }

    /// The whitened error length of every row, in the order of `rows`.
    pub fn errors(&self, model: &Model) -> Vec<f64> {
        let residuals = self.residuals(model);
        residuals.iter().zip(self.rows).map(|(residual, row)| residual.component_mul(&self.weight(*row)).norm()).collect()
    }

    /// Sum of Huber's losses (dimensionless), and the root mean square of the residual length (m).
    pub fn cost(&self, model: &Model) -> (f64, f64) {
        let residuals = self.residuals(model);
        let (mut cost, mut squares) = (0.0, 0.0);
        for (residual, row) in residuals.iter().zip(self.rows) {
            cost += huber(residual.component_mul(&self.weight(*row)).norm());
            squares += residual.norm_squared();
        }
        (cost, (squares / residuals.len().max(1) as f64).sqrt())
    }

    /// The factor of the linearised problem in the `free` parameters of the model's stack.
    pub fn linearise(&self, model: &Model, free: &[usize]) -> Factor {
        let p = free.len();
        let mut column = vec![usize::MAX; model.stack.specs().len()];
        for (j, parameter) in free.iter().enumerate() {
            column[*parameter] = j;
        }
        let factors: Vec<Factor> = self
            .rows
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut scratch = model.stack.scratch(&model.robot);
                let mut rows = Mat::<f64>::zeros(3 * chunk.len(), p + 1);
                for (i, &row) in chunk.iter().enumerate() {
                    let point =
                        model.stack.derivatives(&model.robot, self.data, row, &model.x, &mut scratch, |parameter, derivative| {
                            let j = column[parameter];
                            if j != usize::MAX {
                                for axis in 0..3 {
                                    rows[(3 * i + axis, j)] += derivative[axis];
                                }
                            }
                        });
                    let weight = self.weight(row);
                    let residual = self.data.position[row] - point;
                    let error = residual.component_mul(&weight).norm();
                    let robust = if error > HUBER { (HUBER / error).sqrt() } else { 1.0 };
                    for axis in 0..3 {
                        let scale = weight[axis] * robust;
                        for j in 0..p {
                            rows[(3 * i + axis, j)] *= scale;
                        }
                        rows[(3 * i + axis, p)] = residual[axis] * scale;
                    }
                }
                Factor::of(&rows)
            })
            .collect();
        let mut factors = factors.into_iter();
        let first = factors.next().unwrap_or_else(|| Factor::of(&Mat::zeros(1, p + 1)));
        factors.fold(first, |sum, factor| sum.stack(&factor))
    }
}

fn huber(error: f64) -> f64 {
    if error <= HUBER { 0.5 * error * error } else { HUBER * (error - 0.5 * HUBER) }
}
