//! How certain a compensated position is: the covariance of the parameters, carried to the point.

use super::arm::{IdentifiedArm, Reach};
use crate::estimate::Covariance;
use crate::robot::Measurements;
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
    /// Radius of the sphere about the target that holds the tool with 95 %: parameters, scatter, and laws beyond the rows that they were
    /// fitted to.
    pub u95: f64,
}

/// An effect at a place, and its own parameters in the covariance.
struct Source {
    name: String,
    parameters: Vec<usize>,
}

/// What the rows that were fitted leave open of the parameters, and how the arm scatters.
pub struct Uncertainty {
    covariance: Covariance,
    scatter: Scatter,
    /// Row of each parameter of the stack in the covariance.
    row: Vec<Option<usize>>,
    /// Effects at places, those of the arm.
    sources: Vec<Source>,
    /// Names of the stack's parameters.
    names: Vec<String>,
    /// m, 95 %: what is usual at the recorded poses.
    pub(super) usual: f64,
    /// m: length of one standard deviation of the instrument there.
    pub(super) instrument: f64,
}

impl Uncertainty {
    /// The uncertainty that the parameters of `arm` have; what belonged to the measurement alone does not blur the arm.
    pub fn new(arm: &IdentifiedArm, covariance: Covariance, scatter: Scatter) -> Self {
        let mut row = vec![None; arm.model().x.len()];
        covariance
            .parameters()
            .iter()
            .enumerate()
            .for_each(|(k, parameter)| row[*parameter] = Some(k));
        arm.of_the_measurement()
            .iter()
            .for_each(|parameter| row[*parameter] = None);
        let specs = arm.model().stack.specs();
        let mut names = vec![String::new(); specs.len()];
        let mut sources: Vec<Source> = Vec::new();
        for (effect, range) in arm.model().stack.effects() {
            for k in range {
                names[k] = format!("{} at {}", effect.name(), specs[k].place);
                let Some(row) = row[k] else { continue };
                match sources.iter_mut().find(|source| source.name == names[k]) {
                    Some(source) => source.parameters.push(row),
                    None => sources.push(Source {
                        name: names[k].clone(),
                        parameters: vec![row],
                    }),
                }
            }
        }
        Self {
            covariance,
            scatter,
            row,
            sources,
            names,
            usual: 0.0,
            instrument: 0.0,
        }
    }

    /// The same with what is usual at the poses of a recording, and what its instrument leaves open.
    pub fn with_recording(mut self, arm: &IdentifiedArm, data: &Measurements) -> Self {
        self.usual = self.usual(arm, data);
        self.instrument = Self::instrument(data);
        self
    }

    /// The effect and place of a parameter of the stack.
    pub(super) fn name(&self, parameter: usize) -> String {
        self.names[parameter].clone()
    }

    fn jacobian(&self, reach: &mut Reach, q: &[f64]) -> Vec<Vector3<f64>> {
        let mut jacobian = vec![Vector3::zeros(); self.covariance.parameters().len()];
        reach.derivatives(q, |parameter, derivative| {
            if let Some(k) = self.row[parameter] {
                jacobian[k] += derivative;
            }
        });
        jacobian
    }

    /// Covariance (m2, tracker frame) of the point at command `q` by the parameters.
    pub(super) fn of_parameters(&self, reach: &mut Reach, q: &[f64]) -> Matrix3<f64> {
        self.covariance.of_point(&self.jacobian(reach, q))
    }

    /// Derivatives (m per unit) of the point at command `q` along a direction, by the parameters of the covariance.
    pub(super) fn along(&self, reach: &mut Reach, q: &[f64], along: &Vector3<f64>) -> Vec<f64> {
        self.jacobian(reach, q)
            .iter()
            .map(|derivative| derivative.dot(along))
            .collect()
    }

    /// Variance (m2) along the direction of these derivatives.
    pub(super) fn variance(&self, derivatives: &[f64]) -> f64 {
        self.covariance.along(derivatives)
    }

    /// The same by each effect at a place alone.
    pub(super) fn by_effect(&self, derivatives: &[f64]) -> Vec<(String, f64)> {
        let variance =
            |source: &Source| self.covariance.along_rows(derivatives, &source.parameters);
        self.sources
            .iter()
            .map(|source| (source.name.clone(), variance(source)))
            .collect()
    }

    /// At command `q`, under the circumstances that `reach` is set to.
    pub fn at(&self, reach: &mut Reach, q: &[f64]) -> PositionUncertainty {
        let parameters = self.of_parameters(reach, q);
        let Scatter {
            unexplained,
            repeatability,
        } = self.scatter;
        let mut all = parameters + Matrix3::from_diagonal_element(unexplained * unexplained);
        for law in reach.beyond_fitted(q) {
            all += law.covariance;
        }
        if repeatability > 0.0 {
            all += reach.joint_scatter(q) * (repeatability * repeatability);
        }
        PositionUncertainty {
            sigma: parameters.trace().sqrt(),
            u95: radius_95(all.trace(), all.norm_squared()),
        }
    }
}
