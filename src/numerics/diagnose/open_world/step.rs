//! A model changed: causes taken out, laws and free forms put in, fitted anew and held against folds.

use super::free_form::FreeTerm;
use crate::diagnose::judge::{Alternatives, FoldErrors, JudgedCauses};
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{EstimatedCause, FitState, Fitter};
use crate::effect::{Hypothesis, Variable};
use crate::estimate::Prior;

/// A changed model.
pub(super) struct ModelStep {
    pub state: FitState,
    /// Causes that stay, by their positions.
    pub kept: Vec<usize>,
    pub new: Vec<Hypothesis>,
    /// Errors at poses that a fit did not see.
    pub folds: FoldErrors,
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

    /// With a free form, or nothing. What follows time joins only where stretches of the recording that it did not see are clearly
    /// predicted better with it: the others go on without it.
    pub fn free(&self, terms: &[FreeTerm], sentence: String) -> Option<ModelStep> {
        let (passing, lasting): (Vec<FreeTerm>, Vec<FreeTerm>) = terms.iter().cloned().partition(|term| term.group.drifts());
        let all = self.of_terms(terms, sentence.clone());
        if passing.is_empty() || all.as_ref().is_some_and(|step| self.predicts_stretches(step)) {
            return all;
        }
        if lasting.is_empty() { None } else { self.of_terms(&lasting, sentence) }
    }

    fn predicts_stretches(&self, step: &ModelStep) -> bool {
        let [before, after] = [&self.judged.state, &step.state].map(|state| FoldErrors::of_stretches(state, self.fitter));
        before.zip(after).is_some_and(|(before, after)| after.is_better_than(&before))
    }

    /// With those of some terms that folds need: the first ones as far as folds can judge them and are better, without those that do nothing.
    fn of_terms(&self, terms: &[FreeTerm], sentence: String) -> Option<ModelStep> {
        let mut terms = terms.to_vec();
        loop {
            let Some(step) = self.with_terms(&terms, sentence.clone()) else {
                terms.pop();
                if terms.is_empty() {
                    return None;
                }
                continue;
            };
            let Some(gone) = self.superfluous(&step) else { return Some(step) };
            terms.remove(gone);
        }
    }

    /// The new cause, by its number among these, that other poses or other stretches of the recording are predicted without as well, if the
    /// step has several.
    fn superfluous(&self, step: &ModelStep) -> Option<usize> {
        if step.new.len() < 2 {
            return None;
        }
        let (state, fitter) = (&step.state, self.fitter);
        let (poses, stretches) = (Alternatives::of(state, fitter, &[])?, Alternatives::of_stretches(state, fitter)?);
        let [near_poses, near_stretches] = [poses.near()?, stretches.near()?];
        let [seen_poses, seen_stretches] = [FoldErrors::of(state, fitter)?, FoldErrors::of_stretches(state, fitter)?];
        let gain = |k: usize| {
            let member = [step.kept.len() + k];
            let (bare, stretches) = (near_poses.errors(&member, None)?, near_stretches.errors(&member, None)?);
            let drifts = step.new[k].form.variables().contains(&Variable::Time);
            let gain = seen_poses.gain_over(&bare);
            let carries = if drifts {
                seen_stretches.is_better_than(&stretches)
            } else {
                !stretches.is_better_than(&seen_stretches) && !stretches.is_better_at_an_end_than(&seen_stretches)
            };
            Some((carries && gain > 0.0, gain))
        };
        let gains = (0..step.new.len()).filter_map(|k| Some((gain(k)?, k)));
        let least = gains.filter(|((needed, _), _)| !needed).min_by(|a, b| a.0.1.total_cmp(&b.0.1))?;
        Some(least.1)
    }

    fn with_terms(&self, terms: &[FreeTerm], sentence: String) -> Option<ModelStep> {
        let new: Vec<Hypothesis> = terms.iter().map(|term| term.group.hypothesis()).collect();
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
        let stays = |i: &usize| !self.without.contains(i) && !keys.contains(&pool.keys[judged.set[*i]]);
        let kept: Vec<usize> = (0..judged.set.len()).filter(stays).collect();
        let causes: Vec<EstimatedCause> = kept.iter().map(|i| judged.state.causes[*i].clone()).chain(causes).collect();
        let state = fitter.fit(&judged.state.model, causes);
        let (before, after) = (FoldErrors::of(&judged.state, fitter)?, FoldErrors::of(&state, fitter)?);
        let holds = after.gain_over(&before) > -self.worse * before.rms();
        holds.then_some(ModelStep { state, kept, new, folds: after, sentence })
    }
}
