//! The answer to a target: a command, and what is known of it.

use super::{CorrectionUncertainty, PositionUncertainty, Remark};

/// A command and what is known of it, SI.
#[derive(Debug, Clone)]
pub struct CorrectedCommand {
    /// As the controller counts its joints, rad or m. None where the target is not reached: no joints are better than wrong ones.
    pub q: Option<Vec<f64>>,
    /// How far the uncorrected command would be off by the model.
    pub uncorrected: f64,
    /// How far the uncorrected command would turn the tool away by the model, rad.
    pub turn: f64,
    /// Distance from the wanted point that the model leaves, m.
    pub residual: f64,
    /// Steps of the solution.
    pub iterations: usize,
    /// Uncertainty of the point that is reached; none where the model has no covariance.
    pub uncertainty: Option<PositionUncertainty>,
    /// How certain its correction is along its own direction; none where the model has no covariance.
    pub certainty: Option<CorrectionUncertainty>,
    /// What is wrong with it.
    pub remarks: Vec<Remark>,
}

impl CorrectedCommand {
    /// What is wrong with it, in words; empty if nothing.
    pub fn remark(&self) -> String {
        self.remarks
            .iter()
            .map(Remark::to_string)
            .collect::<Vec<_>>()
            .join("; ")
    }
}
