//! What models with other causes are compared by.

use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{EstimatedCause, FitState, Fitter};
use crate::effect::{Survey, names};

/// The pool in which causes are, and the fitter that tries them.
pub(crate) struct ModelComparison<'a, 'b> {
    pub pool: &'b CachedHypotheses<'a>,
    pub survey: &'b Survey<'a>,
    pub fitter: &'b Fitter<'b>,
}

impl ModelComparison<'_, '_> {
    /// The name that is said of what is called `effect`: none that the user has excluded.
    pub(super) fn said(&self, effect: &'static str) -> &'static str {
        if self.fitter.question.without.iter().any(|name| name == effect) { names::UNKNOWN } else { effect }
    }

    /// The fit without some of the causes, by their positions.
    pub(super) fn without(&self, now: &FitState, members: &[usize]) -> FitState {
        self.fitter.fit(&now.model, others(now, members))
    }
}

/// The causes without some, by their positions.
pub(super) fn others(now: &FitState, members: &[usize]) -> Vec<EstimatedCause> {
    let all = now.causes.iter().enumerate();
    all.filter(|(i, _)| !members.contains(i)).map(|(_, cause)| cause.clone()).collect()
}
