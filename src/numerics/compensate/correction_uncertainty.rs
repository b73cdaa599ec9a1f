//! How certain a correction is, and which finding leaves it open.

use super::arm::{BeyondFitted, IdentifiedArm, Reach};
use super::uncertainty::Uncertainty;
use crate::estimate::choose::median;
use crate::robot::Measurements;
use nalgebra::Vector3;

/// 95 % of a normal distribution lie within so many standard deviations.
const COVERAGE: f64 = 1.96;
/// Recorded poses at which the usual uncertainty is asked, at most.
const POSES: usize = 60;
/// m: a smaller correction is rounding and has no direction.
const NOTHING: f64 = 1e-9;
/// A finding is named where it makes at least this share of the whole by itself.
const NAMED: f64 = 0.5;
/// A correction is doubtful from this share of itself on ...
const DOUBTFUL: f64 = 0.5;
/// ... and above so many standard deviations of the instrument.
const SEEN: f64 = 3.0;
/// Below so many times what is usual where the arm was measured, an uncertainty refuses nothing, however small the correction.
const USUAL: f64 = 6.0;

/// How far a correction may be off.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionUncertainty {
    /// m: the correction at the uncorrected command.
    pub(crate) correction: f64,
    /// m, 95 %: along the correction by the parameters, and in any direction by laws that are used beyond the rows that they were fitted to.
    pub(crate) u95: f64,
    /// The effect and place that most of it comes from, where one stands out.
    pub(crate) finding: Option<String>,
    /// Findings that are used beyond what was fitted and may be off there by more than the instrument leaves open, and over what.
    pub(crate) beyond: Vec<(String, String)>,
    /// m, 95 %: what is usual at the recorded poses; 0 where they are not known.
    pub(crate) usual: f64,
    /// m: length of one standard deviation of the instrument at the recorded poses; 0 where they are not known.
    pub(crate) instrument: f64,
}

impl CorrectionUncertainty {
    /// Whether the correction is doubtful: uncertain by more than half of itself, and by more than the instrument leaves open.
    pub(crate) fn is_doubtful(&self) -> bool {
        self.u95.is_nan() || self.u95 > (DOUBTFUL * self.correction).max(SEEN * self.instrument)
    }

    /// Above this (m) the correction may do more harm than good.
    pub(crate) fn limit(&self) -> f64 {
        self.correction.max(USUAL * self.usual)
    }
}

impl Uncertainty {
    /// What is usual at the poses of a recording, m, 95 % along any direction.
    pub(super) fn usual(&self, arm: &IdentifiedArm, data: &Measurements) -> f64 {
        let mut reach = arm.reach();
        let stride = data.rows().div_ceil(POSES).max(1);
        let rows = (0..data.rows()).step_by(stride);
        let along =
            |row| COVERAGE * (self.of_parameters(&mut reach, data.q(row)).trace() / 3.0).sqrt();
        let all: Vec<f64> = rows.map(along).filter(|value| value.is_finite()).collect();
        if all.is_empty() { 0.0 } else { median(all) }
    }

    /// Length (m) of one standard deviation of the instrument, rms over the rows of a recording.
    pub(super) fn instrument(data: &Measurements) -> f64 {
        let rows = data.rows();
        let squares: f64 = (0..rows)
            .map(|row| data.noise(row).powi(2))
            .filter(|square| square.is_finite())
            .sum();
        (squares / rows.max(1) as f64).sqrt()
    }

    /// How certain the correction (m, tracker frame) is that brought the command to `q`, under the circumstances that `reach` is set to.
    pub(crate) fn of_correction(
        &self,
        reach: &mut Reach,
        q: &[f64],
        correction: &Vector3<f64>,
    ) -> CorrectionUncertainty {
        let beyond: Vec<BeyondFitted> = reach.beyond_fitted(q);
        let size = correction.norm();
        let along = if size > NOTHING {
            correction / size
        } else {
            Vector3::zeros()
        };
        let jacobian = self.along(reach, q, &along);
        let variance =
            self.variance(&jacobian) + beyond.iter().map(BeyondFitted::square).sum::<f64>();
        let seen = |one: &&BeyondFitted| COVERAGE * one.square().sqrt() > self.instrument;
        let named = |one: &BeyondFitted| (self.name(one.parameter), one.variable.to_string());
        let u95 = COVERAGE * variance.sqrt();
        let mut finding = None;
        if u95 > DOUBTFUL * size {
            let mut shares = self.by_effect(&jacobian);
            shares.extend(
                beyond
                    .iter()
                    .map(|one| (self.name(one.parameter), one.square())),
            );
            let most = shares.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            finding = most
                .filter(|(_, own)| *own >= NAMED * variance)
                .map(|(name, _)| name);
        }
        CorrectionUncertainty {
            correction: size,
            u95,
            finding,
            beyond: beyond.iter().filter(seen).map(named).collect(),
            usual: self.usual,
            instrument: self.instrument,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_correction_is_doubtful_above_half_of_itself_and_three_times_the_instrument() {
        let um = |correction: f64, u95: f64| CorrectionUncertainty {
            correction: correction * 1e-6,
            u95: u95 * 1e-6,
            finding: None,
            beyond: Vec::new(),
            usual: 400e-6,
            instrument: 18e-6,
        };
        let doubtful = [(1000.0, 600.0), (1000.0, 400.0), (20.0, 53.0), (20.0, 55.0)]
            .map(|(c, u)| um(c, u).is_doubtful());
        assert_eq!(doubtful, [true, false, false, true]);
    }
}
