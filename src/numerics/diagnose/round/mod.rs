//! A round: the recording is looked at around the present model, which is then fitted anew with the causes that were found.

mod common_size;
mod correlated_noise;
mod fit_state;
mod noise;
mod stretches;

pub(crate) use correlated_noise::correlation_left_by;
pub use fit_state::BASE;
pub(crate) use fit_state::{EstimatedCause, FitState, Fitter, with_causes};

use crate::diagnose::whitened::{WhitenedProblem, add_columns};
use crate::effect::Survey;
use crate::estimate::Model;
use stretches::{bounded_autocorrelation_time, first_of_pose, thinned};

/// Residuals of the rows that a search looks at, and their derivatives.
pub(crate) struct RoundView<'a> {
    pub(crate) now: &'a FitState,
    pub(crate) fitter: &'a Fitter<'a>,
    pub(crate) problem: WhitenedProblem<'a>,
    /// How many rows of correlated residuals count as one.
    pub(crate) autocorrelation_time: f64,
    torque: Vec<f64>,
    /// How far each joint yields, rad/Nm.
    pub(crate) compliance: Vec<f64>,
}

impl<'a> RoundView<'a> {
    pub(crate) fn of(now: &'a FitState, fitter: &'a Fitter<'a>) -> Self {
        let data = &fitter.data;
        let compliance = compliance(&now.model);
        // What shots of a pose have in common is one reading, however often it was taken.
        let kept = &now.screening.kept;
        let alone = now.shots_share_errors().then(|| first_of_pose(data, kept));
        let rows = thinned(data, alone.as_ref().unwrap_or(kept));
        let mut problem = WhitenedProblem::new(&now.model, data, rows);
        if compliance.iter().any(|compliance| *compliance > 0.0) {
            problem = problem.with_currents();
        }
        let autocorrelation_time = bounded_autocorrelation_time(&problem);
        if let Some(noise) = fitter.correlated {
            problem = problem.with_autocorrelation(noise);
        }
        Self {
            now,
            fitter,
            autocorrelation_time,
            torque: problem.torques(),
            compliance,
            problem,
        }
    }

    pub(crate) fn survey(&self) -> Survey<'_> {
        let WhitenedProblem {
            robot, data, rows, ..
        } = &self.problem;
        Survey::new(robot, data, rows, &self.torque, &self.compliance)
    }

    /// The residual of the rows without the causes of a model.
    pub(crate) fn without_causes(&self, now: &FitState) -> Vec<f64> {
        let mut residual = self.problem.residual.clone();
        for cause in &now.causes {
            let columns = self.problem.columns(&cause.form);
            add_columns(&mut residual, &columns, &cause.coefficients);
        }
        residual
    }
}

/// How far each joint yields in a model, rad/Nm.
pub(crate) fn compliance(model: &Model) -> Vec<f64> {
    let mut out = vec![0.0; model.robot.joints()];
    for (effect, range) in model.stack.effects() {
        let form = effect.form();
        if let Some((joint, compliance)) = form.and_then(|form| form.compliance(&model.x[range])) {
            out[joint] += compliance.max(0.0);
        }
    }
    out
}
