//! The verdict of a diagnosis of torques, with errors before and after.

use super::{TorqueVerdict, TorqueVerdictRow};
use crate::diagnose::VerdictKind;
use crate::dynamics::{InertialBasis, TorqueDiagnosis};

impl TorqueVerdictRow {
    /// Whether files and robot do not belong together as they are read.
    pub fn is_wrong_setup(&self) -> bool {
        self.verdict == VerdictKind::WrongSetup.name()
    }
}

impl TorqueVerdict {
    /// The verdict of the stage `step`; `from_current` where motor currents were recorded.
    pub fn of(step: &str, diagnosis: &TorqueDiagnosis, from_current: bool) -> Self {
        let (inertials, base_parameters) = match diagnosis.basis {
            InertialBasis::Declared => ("declared", None),
            InertialBasis::Free(count) => ("free", Some(count as i64)),
        };
        Self(vec![TorqueVerdictRow {
            step: step.into(),
            verdict: diagnosis.verdict.name().into(),
            statement: diagnosis.statement.clone(),
            inertials: inertials.into(),
            base_parameters,
            signal: if from_current { "current" } else { "torque" }.into(),
            cutoff_hz: diagnosis.cutoff,
            rate_hz: diagnosis.rate,
            rows: diagnosis.courses.time.len() as i64,
            held_out: diagnosis.held_out,
            before_nrmse: diagnosis.before.nrmse_mean,
            after_nrmse: diagnosis.after.nrmse_mean,
        }])
    }
}
