//! How certain a compensated position is: the covariance of the parameters, carried to the point.

use super::arm::{IdentifiedArm, Reach};
use crate::estimate::Covariance;
use nalgebra::Vector3;

/// What the rows that were fitted leave open of the parameters.
pub struct Uncertainty {
    covariance: Covariance,
    /// Row of each parameter of the stack in the covariance.
    row: Vec<Option<usize>>,
}

impl Uncertainty {
    /// Of the parameters of `arm`; what belonged to the measurement alone does not blur the arm.
    pub fn new(arm: &IdentifiedArm, covariance: Covariance) -> Self {
        let mut row = vec![None; arm.model().x.len()];
        covariance.parameters().iter().enumerate().for_each(|(k, parameter)| row[*parameter] = Some(k));
        arm.of_the_measurement().iter().for_each(|parameter| row[*parameter] = None);
        Self { covariance, row }
    }

    /// Length (m) of the one-sigma error of the position at command `q`, under the circumstances that `reach` is set to.
    pub fn at(&self, reach: &mut Reach, q: &[f64]) -> f64 {
        let mut jacobian = vec![Vector3::zeros(); self.covariance.parameters().len()];
        reach.derivatives(q, |parameter, derivative| {
            if let Some(k) = self.row[parameter] {
                jacobian[k] += derivative;
            }
        });
        self.covariance.of_point(&jacobian)
    }
}
