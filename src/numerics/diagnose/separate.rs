//! A finding and a rival as two explanations in one model, each at the size that it has in the recording: what poses should separate.

use super::pool::HypothesisSet;
use super::round::compliance;
use super::whitened::WhitenedProblem;
use crate::criteria::search::RIVAL_LEVELS;
use crate::effect::{
    Cause, DeclaredCause, DeclaredForm, Effect, EffectContext, EffectStack, Form, Hypothesis, Load, Place, Survey, Unknown,
    arm_effect, hypotheses,
};
use crate::estimate::Model;
use crate::estimate::choose::{Alternative, DiscriminationProblem};
use crate::robot::Measurements;
use std::collections::BTreeSet;

/// A diagnosed model where it stands.
pub struct DiagnosedModel<'a> {
    /// The model with its findings.
    pub model: &'a Model,
    /// The recording that it was diagnosed on.
    pub data: &'a Measurements,
    /// Fitted rows, ascending.
    pub rows: &'a [usize],
    /// Positions in the stack of what was estimated.
    pub free: &'a [usize],
}

/// The finding of these forms beside the rival `effect` at `place`: of its forms the one that fits
/// best in its place, and as it fits there. Fails with a sentence where the recording knows no such rival.
pub fn discrimination_problem(
    diagnosed: &DiagnosedModel,
    finding: &[Form],
    (effect, place): (&str, Place),
) -> Result<(DiscriminationProblem, Form), String> {
    let DiagnosedModel { model, data, rows, free } = *diagnosed;
    let problem = WhitenedProblem::new(model, data, rows.to_vec());
    let (torque, compliance) = (problem.torques(), compliance(model));
    let survey = Survey::new(&model.robot, data, rows, &torque, &compliance);
    let is = |form: &&Form| finding.contains(*form);
    let of = |(other, range): (&dyn Effect, std::ops::Range<usize>)| other.form().filter(is).map(|_| range);
    let own: Vec<usize> = model.stack.effects().filter_map(of).flatten().collect();
    let mut caused = vec![0.0; problem.residual_rows()];
    for (form, range) in model.stack.effects().filter_map(|(other, range)| Some((other.form().filter(is)?, range))) {
        for (column, size) in problem.columns(form).chunks(problem.residual_rows()).zip(&model.x[range]) {
            caused.iter_mut().zip(column).for_each(|(sum, value)| *sum += value * size);
        }
    }
    let nuisances: Vec<usize> = free.iter().copied().filter(|k| !own.contains(k)).collect();
    let jacobian = problem.jacobian(&nuisances);
    let rivals = rivals(&survey, model, (effect, place), finding)?;
    let open: Vec<f64> = problem.residual.iter().zip(&caused).map(|(left, own)| left + own).collect();
    // As diagnosis names rivals: by what fits in place of the finding.
    let mut pool = HypothesisSet::new(&problem, &jacobian, &open, rivals);
    let Some((_, mut best)) = best(&pool, 0) else { return Err(format!("no form of {effect} at {place} can be tried")) };
    for level in 0..*RIVAL_LEVELS {
        let own = pool.hypotheses[best].clone();
        let near = own.form.near(&survey, level).into_iter().map(|form| Hypothesis { form, ..own.clone() });
        let first = pool.add(near.collect());
        match self::best(&pool, first) {
            Some((score, k)) if score < self::score(&pool, best) => best = k,
            _ => (),
        }
    }
    let fitted = pool.solve(&[best]).coefficients;
    let rival = &pool.hypotheses[best];
    let both = with(model, &rival.form);
    let held = both.stack.effects().find(|(other, _)| other.form() == Some(&rival.form));
    let of_rival: Vec<usize> = held.map(|(_, range)| range.collect()).unwrap_or_default();
    let sizes = own.iter().map(|k| model.x[*k]).collect();
    let sides = [Alternative { parameters: own, sizes }, Alternative { parameters: of_rival, sizes: fitted }];
    Ok((DiscriminationProblem { model: both, nuisances, sides }, rival.form.clone()))
}

/// How well one form fits, with a penalty for every parameter.
fn score(pool: &HypothesisSet, k: usize) -> f64 {
    let (solution, rows) = (pool.solve(&[k]), pool.residual_rows as f64);
    rows * ((pool.square - solution.gain).max(f64::MIN_POSITIVE) / rows).ln() + rows.ln() * solution.rank as f64
}

/// The best of the forms from `first` on, with its score.
fn best(pool: &HypothesisSet, first: usize) -> Option<(f64, usize)> {
    (first..pool.hypotheses.len()).map(|k| (score(pool, k), k)).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// All that diagnosis would try under this name at this place.
fn rivals(survey: &Survey, model: &Model, (effect, place): (&str, Place), finding: &[Form]) -> Result<Vec<Hypothesis>, String> {
    // What is called by its shape alone.
    let named = |form: &Form| form.name() == effect || form.is(&Unknown) && form.called(&[], survey) == effect;
    let declared = |(other, _): (&dyn Effect, std::ops::Range<usize>)| Some(other.form()?.declared()?.declaration());
    let mut own: Vec<&'static DeclaredCause> = model.stack.effects().filter_map(declared).collect();
    own.dedup_by_key(|cause| cause.name());
    let own = own.into_iter().flat_map(|cause| DeclaredForm::hypotheses(cause, survey));
    let all = hypotheses(survey).into_iter().chain(own).filter(|hypothesis| named(&hypothesis.form));
    let all: Vec<Hypothesis> = all.filter(|hypothesis| finding != std::slice::from_ref(&hypothesis.form)).collect();
    let own: Vec<Hypothesis> = all.iter().filter(|hypothesis| hypothesis.form.place() == place).cloned().collect();
    if !own.is_empty() {
        return Ok(own);
    }
    let places: BTreeSet<Place> = all.iter().map(|hypothesis| hypothesis.form.place()).collect();
    if places.is_empty() {
        return Err(format!("{effect} cannot be tried on this robot and recording"));
    }
    Err(format!(
        "{effect} has no place `{place}` here; allowed: {}",
        places.iter().map(Place::to_string).collect::<Vec<_>>().join(", ")
    ))
}

/// The model with one form more, at zero, where it has it not.
fn with(model: &Model, form: &Form) -> Model {
    if model.stack.effects().any(|(other, _)| other.form() == Some(form)) {
        return model.clone();
    }
    let setting = EffectContext { base: *model.stack.base(), load: Load::GravityTorque };
    let again = |effect: &dyn Effect| -> Option<Box<dyn Effect>> {
        match effect.form() {
            Some(form) => Some(Box::new(form.clone())),
            None => arm_effect(effect.name(), &setting),
        }
    };
    let mut effects: Vec<Box<dyn Effect>> = model.stack.effects().filter_map(|(effect, _)| again(effect)).collect();
    effects.push(Box::new(form.clone()));
    let mut both = Model::nominal(model.robot.clone(), EffectStack::new(&model.robot, setting.base, effects));
    both.x[..model.x.len()].copy_from_slice(&model.x);
    both
}
