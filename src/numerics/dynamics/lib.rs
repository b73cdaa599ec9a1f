//! Torques of a moving arm: which physics a rigid inverse dynamics lacks.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_diagnose as diagnose;
use calib_foundation::statistics;
use calib_numerics::{criteria, effect, error, estimate, spatial};

mod arm;
mod carried;
#[cfg(test)]
mod cases;
#[cfg(test)]
mod cases_names;
mod cause;
mod cells;
mod changes;
mod check;
mod check_gravity;
mod columns;
mod contact;
mod enforce;
mod even;
mod excite;
mod feed_forward;
mod filter;
mod findings;
mod given;
mod latency;
mod masses;
mod model;
mod newton_euler;
mod outcome;
mod problem;
mod recording;
mod refine;
mod scene;
mod search;
mod seen_gravity;
mod sliding;
mod solve;
mod spectrum;
mod sweep;
mod thin;
mod types;
mod used;
mod weighted;

pub use arm::{DynamicArm, INERTIAL_NAMES, INERTIAL_NUMBERS, Inertial, InertialTolerance};
pub use cause::{COULOMB, FittedNumber, TorqueParameter, is_cause};
pub use changes::{DiagnosedRecording, TorqueChange, TorqueChanges, changes};
pub use excite::{ExciteRequest, ExcitingMotion, ExpectedSigma, excite};
pub use feed_forward::{JudgedRow, NeededTorques, PlannedMotion, TorqueGate, TorqueRemark};
pub use masses::{BodyConsistency, LinkFromTorques, inertial_numbers};
pub use model::{FrictionCurve, JointRange, TorqueModel, TorqueTerm};
pub use newton_euler::{InverseDynamics, MotionRow};
pub use recording::{TorqueRecording, TorqueSource};
pub use sliding::unit_at;
pub use types::{
    ContactEvent, EnforcedBodies, InertialBasis, InertialEstimate, TorqueCourses, TorqueDiagnosis,
    TorqueErrors, TorqueFinding, TorqueLeftover, TorqueNoise, TorqueQuestion,
};

use crate::error::{Error, Result};
pub use diagnose::{CellAnswer, GivenCell};
use recording::RecordingClock;
use used::UsedRecording;

/// What torques that come late are called.
const LATENCY: &str = "current_latency";
/// What a push on the arm is called.
const CONTACT: &str = "contact";
/// Rows of the longest stretch without a jump, at least.
const LEAST_STRETCH: usize = 200;
/// At most this share of the rate.
const HIGHEST_CUTOFF: f64 = 0.3;

/// Diagnoses a recording of torques; `tell` receives the progress, a line each. Of a recording that is too long to be held at once, rows are
/// kept after a low-pass, which a remark says; the rows of the result are those of the recording.
///
/// # Errors
/// [`crate::error::Error::Data`] where the recording cannot be used: sizes, a clock that jumps, constant columns, units, or an arm that
/// hardly moves; and what reading it fails with.
pub fn diagnose(
    arm: &DynamicArm,
    recording: &dyn TorqueSource,
    question: &TorqueQuestion,
    tell: &mut dyn FnMut(String),
) -> Result<TorqueDiagnosis> {
    let used = UsedRecording::of(arm, recording, question.cutoff)?;
    diagnose_used(arm, used, question, tell)
}

/// What every cell of the table of torques says of a recording given some of them, for the sum over a fleet; sizes in Nm.
///
/// # Errors
/// As of [`diagnose()`].
pub fn cell_evidence(
    arm: &DynamicArm,
    recording: &dyn TorqueSource,
    question: &TorqueQuestion,
    given: &[GivenCell],
    tell: &mut dyn FnMut(String),
) -> Result<Vec<CellAnswer>> {
    let used = UsedRecording::of(arm, recording, question.cutoff)?;
    let (mut solved, _) = solved(arm, used.recording, &used.clock, question, tell)?;
    Ok(given::answers(&mut solved, given))
}

fn diagnose_used(
    arm: &DynamicArm,
    used: UsedRecording,
    question: &TorqueQuestion,
    tell: &mut dyn FnMut(String),
) -> Result<TorqueDiagnosis> {
    let (solved, remark) = solved(arm, used.recording, &used.clock, question, tell)?;
    let remarks = used.remarks.into_iter().chain(remark);
    let mut diagnosis = outcome::outcome(&solved, question, remarks.collect());
    for row in &mut diagnosis.courses.row {
        *row = used.origin[*row];
    }
    Ok(diagnosis)
}

/// The answer to a recording, and what is to be said of its cut-off.
fn solved<'a>(
    arm: &'a DynamicArm,
    recording: TorqueRecording,
    clock: &RecordingClock,
    question: &TorqueQuestion,
    tell: &mut dyn FnMut(String),
) -> Result<(solve::SolvedTorques<'a>, Option<String>)> {
    let mut stretches = clock.stretches.iter();
    if stretches.all(|stretch| stretch.len() < LEAST_STRETCH) {
        let message = format!(
            "the clock or a joint jumps in every {LEAST_STRETCH} rows: nothing can be filtered"
        );
        return Err(Error::data("time", message));
    }
    let most = HIGHEST_CUTOFF * clock.rate;
    let usual = recording::cutoff(&recording, clock).min(most);
    let common = (!question.free_inertials)
        .then(|| spectrum::common(arm, &recording, clock, usual))
        .flatten();
    let (cutoff, remark) = match question.cutoff {
        Some(asked) => (asked.min(most), None),
        None => {
            let remark = common.map(|common| spectrum::remark(common, usual));
            (common.unwrap_or(usual), remark)
        }
    };
    let followed = common.map_or(cutoff, |common| common.min(cutoff));
    let band = problem::TorqueBand { cutoff, followed };
    let solved = solve::solve(arm, recording, question, clock, band, tell);
    Ok((solved, remark))
}
