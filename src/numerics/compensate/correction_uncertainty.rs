//! How certain a correction is along its own direction, and which finding leaves it open.

use super::arm::{BeyondFitted, IdentifiedArm, Reach};
use super::uncertainty::Uncertainty;
use crate::estimate::choose::median;
use crate::robot::Measurements;
use nalgebra::Vector3;

/// 95 % of a normal distribution lie within so many standard deviations.
const COVERAGE: f64 = 1.96;
/// Recorded poses at which the usual uncertainty is asked, at most.
const POSES: usize = 60;
/// A law may be this share of its range beyond it without a word.
const SLACK: f64 = 0.02;
/// A finding is named where it makes at least this share of the whole by itself.
const NAMED: f64 = 0.5;
/// Below so many times what is usual where the arm was measured, an uncertainty is of no account, however small the correction.
const USUAL: f64 = 3.0;

/// How far a correction may be off along its own direction.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionUncertainty {
    /// m: the correction at the uncorrected command.
    pub correction: f64,
    /// m, 95 %: by the parameters, and by laws that are used beyond the rows that they were fitted to.
    pub u95: f64,
    /// The effect and place that most of it comes from, where one stands out.
    pub finding: Option<String>,
    /// Findings that are used beyond what was fitted, and over what.
    pub beyond: Vec<(String, String)>,
    /// m, 95 %: what is usual at the recorded poses; 0 where they are not known.
    pub usual: f64,
}

impl CorrectionUncertainty {
    /// Whether it is above half of the correction, and above what is usual.
    pub fn is_remarkable(&self) -> bool {
        self.u95.is_nan() || self.u95 > (0.5 * self.correction).max(USUAL * self.usual)
    }

    /// Above this (m) the correction may do more harm than good.
    pub fn limit(&self) -> f64 {
        self.correction.max(2.0 * USUAL * self.usual)
    }
}

impl Uncertainty {
    /// What is usual at the poses of a recording, m, 95 % along any direction.
    pub(super) fn usual(&self, arm: &IdentifiedArm, data: &Measurements) -> f64 {
        let mut reach = arm.reach();
        let stride = data.rows().div_ceil(POSES).max(1);
        let rows = (0..data.rows()).step_by(stride);
        let along = |row| COVERAGE * (self.of_parameters(&mut reach, data.q(row)).trace() / 3.0).sqrt();
        let all: Vec<f64> = rows.map(along).filter(|value| value.is_finite()).collect();
        if all.is_empty() { 0.0 } else { median(all) }
    }

    /// How certain the correction (m, tracker frame) is that brought the command to `q`, under the circumstances that `reach` is set to.
    pub fn of_correction(&self, reach: &mut Reach, q: &[f64], correction: &Vector3<f64>) -> CorrectionUncertainty {
        let beyond: Vec<BeyondFitted> = reach.beyond_fitted(q).into_iter().filter(|one| one.share > SLACK).collect();
        let size = correction.norm();
        let along = if size > 0.0 { correction / size } else { Vector3::zeros() };
        let by_range = |one: &BeyondFitted| (one.share * one.displacement.dot(&along)).powi(2);
        let jacobian = self.along(reach, q, &along);
        let variance = self.variance(&jacobian) + beyond.iter().map(by_range).sum::<f64>();
        let named: Vec<(String, String)> =
            beyond.iter().map(|one| (self.name(one.parameters.start), one.variable.to_string())).collect();
        let u95 = COVERAGE * variance.sqrt();
        let mut finding = None;
        if u95 > 0.5 * size {
            let mut shares = self.by_effect(&jacobian);
            shares.extend(beyond.iter().zip(&named).map(|(one, (name, _))| (name.clone(), by_range(one))));
            let most = shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            finding = most.filter(|(_, own)| *own >= NAMED * variance).map(|(name, _)| name);
        }
        CorrectionUncertainty { correction: size, u95, finding, beyond: named, usual: self.usual }
    }
}
