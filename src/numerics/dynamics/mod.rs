//! Torques of a moving arm: which physics a rigid inverse dynamics lacks.

mod arm;
mod recording;
mod types;

pub use arm::{DynamicArm, Inertial, InertialTolerance};
pub use recording::TorqueRecording;
pub use types::{
    ContactEvent, FrictionCurve, InertialBasis, InertialEstimate, TorqueCourses, TorqueDiagnosis, TorqueErrors, TorqueEvidence,
    TorqueFinding, TorqueLeftover, TorqueNoise, TorqueParameter, TorqueQuestion, TorqueRival,
};

use crate::error::{Error, Result};

/// Diagnoses a recording of torques; `tell` receives the progress, a line each.
///
/// # Errors
/// [`Error::Data`] where the recording cannot be used: sizes, a clock that jumps, constant columns, units, or an arm that hardly moves.
pub fn diagnose(
    arm: &DynamicArm,
    recording: &TorqueRecording,
    question: &TorqueQuestion,
    tell: &mut dyn FnMut(String),
) -> Result<TorqueDiagnosis> {
    let _ = (arm, recording, question);
    tell("torques".into());
    Err(Error::data("torques", "not built yet"))
}
