//! How certain a compensated position is: the covariance of the parameters, carried to the point.

use super::arm::{Arm, Reach};
use crate::estimate::Model;
use crate::robot::Measurements;
use nalgebra::linalg::Cholesky;
use nalgebra::{DMatrix, Dyn, Vector3};

/// Covariance of the estimated parameters from the rows that they were fitted to.
pub struct Uncertainty {
    /// Column of each parameter of the stack.
    column: Vec<Option<usize>>,
    free: usize,
    /// Of the information matrix with its columns scaled.
    factor: Cholesky<f64, Dyn>,
    scale: Vec<f64>,
}

impl Uncertainty {
    /// For the parameters `free` of the model, fitted to `data` with `sigma` (m) per axis. None where they are not all determined.
    pub fn new(arm: &Arm, free: &[usize], data: &Measurements, sigma: f64) -> Option<Self> {
        let Model { robot, stack, x, .. } = arm.model();
        let mut column = vec![None; stack.specs().len()];
        for (k, parameter) in free.iter().enumerate() {
            *column.get_mut(*parameter)? = Some(k);
        }
        let p = free.len();
        if p == 0 || data.rows() == 0 {
            return None;
        }
        let mut information = DMatrix::<f64>::zeros(p, p);
        let mut scratch = stack.scratch(robot);
        let mut jacobian = vec![Vector3::zeros(); p];
        for row in 0..data.rows() {
            jacobian.fill(Vector3::zeros());
            stack.derivatives(robot, data, row, x, &mut scratch, |parameter, derivative| {
                if let Some(k) = column[parameter] {
                    jacobian[k] += derivative / sigma;
                }
            });
            for i in 0..p {
                for j in 0..=i {
                    information[(i, j)] += jacobian[i].dot(&jacobian[j]);
                }
            }
        }
        let scale: Vec<f64> = (0..p).map(|k| information[(k, k)].sqrt()).collect();
        if scale.iter().any(|value| !(value.is_finite() && *value > 0.0)) {
            return None;
        }
        for i in 0..p {
            for j in 0..=i {
                let value = information[(i, j)] / (scale[i] * scale[j]);
                (information[(i, j)], information[(j, i)]) = (value, value);
            }
        }
        Some(Self { column, free: p, factor: information.cholesky()?, scale })
    }

    /// Length (m) of the one-sigma error of the position at command `q`, under the circumstances that `reach` is set to.
    pub fn at(&self, reach: &mut Reach, q: &[f64]) -> f64 {
        let mut jacobian = DMatrix::<f64>::zeros(self.free, 3);
        reach.derivatives(q, |parameter, derivative| {
            if let Some(k) = self.column[parameter] {
                for axis in 0..3 {
                    jacobian[(k, axis)] += derivative[axis] / self.scale[k];
                }
            }
        });
        // Covariance is (L L^T)^-1: the length of L^-1 J^T.
        self.factor.l_dirty().solve_lower_triangular_mut(&mut jacobian);
        jacobian.norm()
    }
}
