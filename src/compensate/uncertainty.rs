//! How certain a compensated position is: the covariance of the parameters, carried to the point.

use super::arm::{IdentifiedArm, Reach};
use crate::estimate::Covariance;
use crate::statistics::radius_95;
use nalgebra::{Matrix3, Vector3};

/// How the arm scatters about the model, whatever its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scatter {
    /// Standard deviation per axis of what the model leaves unexplained, m.
    pub unexplained: f64,
    /// Standard deviation of every revolute joint that comes back to a pose, rad.
    pub repeatability: f64,
}

/// How far a position may be off, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionUncertainty {
    /// One-sigma length by the parameters' covariance alone: root of the summed variances.
    pub sigma: f64,
    /// Radius of the sphere about the target that holds the tool with 95 %: parameters and scatter.
    pub u95: f64,
}

/// What the rows that were fitted leave open of the parameters, and how the arm scatters.
pub struct Uncertainty {
    covariance: Covariance,
    scatter: Scatter,
    /// Row of each parameter of the stack in the covariance.
    row: Vec<Option<usize>>,
}

impl Uncertainty {
    /// Of the parameters of `arm`; what belonged to the measurement alone does not blur the arm.
    pub fn new(arm: &IdentifiedArm, covariance: Covariance, scatter: Scatter) -> Self {
        let mut row = vec![None; arm.model().x.len()];
        covariance.parameters().iter().enumerate().for_each(|(k, parameter)| row[*parameter] = Some(k));
        arm.of_the_measurement().iter().for_each(|parameter| row[*parameter] = None);
        Self { covariance, scatter, row }
    }

    /// At command `q`, under the circumstances that `reach` is set to.
    pub fn at(&self, reach: &mut Reach, q: &[f64]) -> PositionUncertainty {
        let mut jacobian = vec![Vector3::zeros(); self.covariance.parameters().len()];
        reach.derivatives(q, |parameter, derivative| {
            if let Some(k) = self.row[parameter] {
                jacobian[k] += derivative;
            }
        });
        let parameters = self.covariance.of_point(&jacobian);
        let Scatter { unexplained, repeatability } = self.scatter;
        let mut all = parameters + Matrix3::from_diagonal_element(unexplained * unexplained);
        if repeatability > 0.0 {
            all += reach.joint_scatter(q) * (repeatability * repeatability);
        }
        PositionUncertainty { sigma: parameters.trace().sqrt(), u95: radius_95(all.trace(), all.norm_squared()) }
    }
}
