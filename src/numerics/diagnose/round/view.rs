//! The recording around the present model, as a round looks at it.

use super::fit_state::{EstimatedCause, FitState, Fitter};
use super::stretches::{bounded_autocorrelation_time, poses, thinned};
use crate::diagnose::pool::{CachedHypotheses, EarlierPool, HypothesisSet};
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::{DeclaredForm, Hypothesis, Survey, Variable, hypotheses};
use crate::estimate::Model;

/// What is left of the rows that a search looks at, and what moves it.
pub(crate) struct RoundView<'a> {
    pub problem: WhitenedProblem<'a>,
    /// Pose of each row.
    pub pose: Vec<usize>,
    autocorrelation_time: f64,
    torque: Vec<f64>,
    /// How far each joint yields, rad/Nm.
    pub compliance: Vec<f64>,
}

impl<'a> RoundView<'a> {
    pub fn of(now: &'a FitState, fitter: &'a Fitter) -> Self {
        let data = &fitter.data;
        let compliance = compliance(&now.model);
        let mut problem = WhitenedProblem::new(&now.model, data, thinned(data, &now.screening.kept));
        if compliance.iter().any(|compliance| *compliance > 0.0) {
            problem = problem.with_currents();
        }
        let autocorrelation_time = bounded_autocorrelation_time(&problem);
        if let Some(noise) = fitter.correlated {
            problem = problem.with_autocorrelation(noise);
        }
        let pose = poses(data, &problem.rows, autocorrelation_time);
        Self { pose, autocorrelation_time, torque: problem.torques(), compliance, problem }
    }

    /// How many rows of what is left count as one.
    pub fn autocorrelation_time(&self) -> f64 {
        self.autocorrelation_time
    }

    pub fn survey(&self) -> Survey<'_> {
        let WhitenedProblem { robot, data, rows, .. } = &self.problem;
        Survey::new(robot, data, rows, &self.torque, &self.compliance)
    }

    /// The pool of all causes around the present model, or around that of an `earlier` round: the residual is that without them.
    pub fn pool(&self, now: &FitState, fitter: &Fitter, survey: &Survey, earlier: Option<EarlierPool>) -> CachedHypotheses<'_> {
        let problem = &self.problem;
        let mut residual = problem.residual.clone();
        for EstimatedCause { form, coefficients, .. } in &now.causes {
            let columns = problem.columns(form);
            for (column, coefficient) in columns.chunks(problem.residual_rows()).zip(coefficients) {
                residual.iter_mut().zip(column).for_each(|(value, c)| *value += c * coefficient);
            }
        }
        if let Some(earlier) = earlier.filter(|earlier| earlier.serves(&self.problem, &self.compliance)) {
            return CachedHypotheses::again(earlier, problem, &residual, self.autocorrelation_time);
        }
        let jacobian = problem.jacobian(fitter.free());
        let tried = |hypothesis: &Hypothesis| !fitter.question.without.iter().any(|name| name == hypothesis.form.cause().name());
        let mut hypotheses: Vec<Hypothesis> = hypotheses(survey).into_iter().filter(tried).collect();
        hypotheses.extend(fitter.question.own.iter().flat_map(|cause| DeclaredForm::hypotheses(cause, survey)));
        if fitter.causes_of_the_arm_first() {
            hypotheses.retain(|hypothesis| !hypothesis.form.variables().contains(&Variable::Time));
        }
        hypotheses.iter_mut().for_each(|hypothesis| hypothesis.prior_penalty *= fitter.question.prior_weight);
        HypothesisSet::new(problem, &jacobian, &residual, self.autocorrelation_time, hypotheses).into()
    }
}

/// How far each joint yields in a model, rad/Nm.
pub(crate) fn compliance(model: &Model) -> Vec<f64> {
    let mut out = vec![0.0; model.robot.joints()];
    for (effect, range) in model.stack.effects() {
        if let Some((joint, compliance)) = effect.form().and_then(|form| form.compliance(&model.x[range])) {
            out[joint] += compliance.max(0.0);
        }
    }
    out
}
