//! A model changed: causes taken out, laws and free forms put in, fitted anew and held against folds.

use super::free_form::FreeTerm;
use crate::diagnose::judge::{FoldErrors, JudgedCauses, errors_at_ends};
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{EstimatedCause, FitState, Fitter};
use crate::effect::{Basis, Effect, Form, Hypothesis, JointTable, Variable};
use crate::estimate::Prior;

/// A changed model.
pub(super) struct ModelStep {
    pub state: FitState,
    /// Causes that stay, by their positions.
    pub kept: Vec<usize>,
    pub new: Vec<Hypothesis>,
    /// What was done.
    pub sentence: String,
}

/// What is changed of a judged model.
pub(super) struct ModelChange<'c, 'a> {
    pub judged: &'c JudgedCauses,
    pub pool: &'c CachedHypotheses<'a>,
    pub fitter: &'c Fitter<'c>,
    /// Causes that go, by their positions.
    pub without: &'c [usize],
    /// Share of the folds' rms that it may cost.
    pub worse: f64,
}

impl ModelChange<'_, '_> {
    /// With a law of the list.
    pub fn law(&self, law: Hypothesis, sentence: String) -> Option<ModelStep> {
        let robot = self.pool.problem.robot;
        let zeros = vec![0.0; law.form.parameters(robot).len()];
        let cause = EstimatedCause::shrunk(law.form.clone(), robot, zeros);
        self.with(vec![law], vec![cause], sentence)
    }

    /// With a free form, or nothing.
    pub fn free(&self, terms: &[FreeTerm], sentence: String) -> Option<ModelStep> {
        let without = self.fitter.question.without;
        let new: Vec<Hypothesis> = terms.iter().map(|term| term.group.hypothesis(without)).collect();
        let prior = |variance: &f64| Prior { mean: 0.0, sigma: variance.sqrt() };
        let cause = |(hypothesis, term): (&Hypothesis, &FreeTerm)| EstimatedCause {
            form: hypothesis.form.clone(),
            coefficients: vec![0.0; term.variances.len()],
            priors: term.variances.iter().map(prior).collect(),
        };
        let causes = new.iter().zip(terms).map(cause).collect();
        self.with(new, causes, sentence)
    }

    /// Where folds are no worse by more than the share; causes of the same key go.
    fn with(&self, new: Vec<Hypothesis>, causes: Vec<EstimatedCause>, sentence: String) -> Option<ModelStep> {
        let Self { judged, pool, fitter, .. } = *self;
        let keys: Vec<String> = new.iter().map(|hypothesis| hypothesis.form.key()).collect();
        let contained = |i: usize| new.iter().any(|hypothesis| holds(&hypothesis.form, &judged.state.causes[i].form));
        let stays = |i: &usize| !self.without.contains(i) && !keys.contains(&pool.keys[judged.set[*i]]) && !contained(*i);
        let kept: Vec<usize> = (0..judged.set.len()).filter(stays).collect();
        let causes: Vec<EstimatedCause> = kept.iter().map(|i| judged.state.causes[*i].clone()).chain(causes).collect();
        let state = fitter.fit(&judged.state.model, causes);
        let (before, after) = (FoldErrors::of(&judged.state, fitter)?, FoldErrors::of(&state, fitter)?);
        // What passes is predicted beyond what was fitted, too.
        if new.iter().any(|hypothesis| hypothesis.form.variables().iter().any(passes)) {
            let [before, after] = [&judged.state, &state].map(|state| errors_at_ends(state, fitter));
            if after? > before? {
                return None;
            }
        }
        (after.gain_over(&before) > -self.worse * before.rms()).then_some(ModelStep { state, kept, new, sentence })
    }
}

/// Whether a joint's curve has another of its errors over the angle in it: a wave that it resolves, or another curve. Beside each other they
/// would hold each other up where there are rows, and nowhere else.
fn holds(curve: &Form, other: &Form) -> bool {
    let (Some(own), Some(other)) = (curve.term(), other.term()) else { return false };
    let Basis::Cosines { low, high, count } = own.basis() else { return false };
    let alike = own.motion() == other.motion() && own.law().variables() == other.law().variables();
    let resolved = match other.basis() {
        Basis::Wave { order, .. } => f64::from(order) * (high - low) < std::f64::consts::PI * count as f64,
        Basis::Fading { .. } => true,
        _ => false,
    };
    curve.is(&JointTable) && alike && resolved
}

/// Whether a variable goes on where the recording ends.
fn passes(of: &Variable) -> bool {
    matches!(of, Variable::Time | Variable::Temperature)
}
