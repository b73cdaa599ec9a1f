//! A finding and a rival as two explanations in one model, each at the size that it has in the recording: what poses should separate.

use super::regression::{FormRegression, Solution};
use super::round::compliance;
use super::table::forms_of;
use super::types::Question;
use super::whitened::{WhitenedProblem, add_columns};
use crate::criteria::cells::USUAL;
use crate::effect::{
    DeclaredCause, Effect, EffectContext, EffectStack, Form, Load, Place, Survey, arm_effect,
};
use crate::estimate::Model;
use crate::estimate::choose::{Alternative, DiscriminationProblem};
use crate::robot::Measurements;
use std::sync::Arc;

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
    let DiagnosedModel {
        model,
        data,
        rows,
        free,
    } = *diagnosed;
    let problem = WhitenedProblem::new(model, data, rows.to_vec());
    let (torque, compliance) = (problem.torques(), compliance(model));
    let survey = Survey::new(&model.robot, data, rows, &torque, &compliance);
    let effects = model.stack.effects();
    let parts: Vec<(&Form, std::ops::Range<usize>)> = effects
        .filter_map(|(effect, range)| Some((effect.form()?, range)))
        .filter(|(form, _)| finding.contains(form))
        .collect();
    let forms: Vec<usize> = parts.iter().flat_map(|(_, range)| range.clone()).collect();
    let mut caused = vec![0.0; problem.residual_rows()];
    for (form, range) in parts {
        add_columns(&mut caused, &problem.columns(form), &model.x[range]);
    }
    let mut nuisances = free.to_vec();
    nuisances.retain(|k| !forms.contains(k));
    let base = problem.basis(&nuisances);
    let open = problem.residual.iter().zip(&caused);
    let open: Vec<f64> = open.map(|(left, caused)| left + caused).collect();
    // As diagnosis names rivals: by what fits in place of the finding.
    let reference = FormRegression::new(&problem, &base, &[], &open);
    let others = rivals(&survey, &problem, model, (effect, place))?
        .into_iter()
        .filter(|form| finding != std::slice::from_ref(form));
    let fitted = others.map(|form| (reference.solve(&form), form));
    let best = fitted.min_by(|a, b| score(&reference, &a.0).total_cmp(&score(&reference, &b.0)));
    let Some((_, form)) = best else {
        return Err(format!("no form of {effect} at {place} can be tried"));
    };
    let rival = reference.refined(form, &survey);
    let both = with(model, &rival);
    let is_rival = |(other, _): &(&dyn Effect, _)| other.form() == Some(&rival);
    let held = both.stack.effects().find(is_rival);
    let rival_numbers = held.map_or_else(Vec::new, |(_, range)| range.collect());
    let sizes = forms.iter().map(|k| model.x[*k]).collect();
    let sides = [
        Alternative {
            parameters: forms,
            sizes,
        },
        Alternative {
            parameters: rival_numbers,
            sizes: reference.solve(&rival).coefficients,
        },
    ];
    Ok((
        DiscriminationProblem {
            model: both,
            nuisances,
            sides,
        },
        rival,
    ))
}

/// How well one form fits, with a penalty for every parameter (Schwarz, 1978).
fn score(reference: &FormRegression, solution: &Solution) -> f64 {
    let rows = reference.rows() as f64;
    rows * ((reference.square - solution.gain).max(f64::MIN_POSITIVE) / rows).ln()
        + rows.ln() * solution.rank as f64
}

/// The forms of this name at this place, as diagnosis has them.
fn rivals(
    survey: &Survey,
    problem: &WhitenedProblem,
    model: &Model,
    (effect, place): (&str, Place),
) -> Result<Vec<Form>, String> {
    let declared = |(other, _): (&dyn Effect, std::ops::Range<usize>)| {
        Some(other.form()?.declared()?.declaration().clone())
    };
    let mut declared_causes: Vec<Arc<DeclaredCause>> =
        model.stack.effects().filter_map(declared).collect();
    declared_causes.dedup_by(|a, b| a.name() == b.name());
    let question = Question {
        robot: survey.robot,
        data: survey.data,
        fit: survey.rows,
        validate: &[],
        set: &[],
        prior_weight: 1.0,
        open_world: *USUAL,
        without: &[],
        declared: &declared_causes,
        beside_simulation: false,
        known: &[],
        seed: 0,
    };
    forms_of((effect, place), &question, survey, problem).map_err(|places| {
        if places.is_empty() {
            return format!("{effect} cannot be tried on this robot and recording");
        }
        let allowed: Vec<String> = places.iter().map(Place::to_string).collect();
        format!(
            "{effect} has no place `{place}` here; allowed: {}",
            allowed.join(", ")
        )
    })
}

/// The model with one form more, at zero, where it has it not.
fn with(model: &Model, form: &Form) -> Model {
    if model
        .stack
        .effects()
        .any(|(other, _)| other.form() == Some(form))
    {
        return model.clone();
    }
    let setting = EffectContext {
        base: *model.stack.base(),
        load: Load::GravityTorque,
    };
    let again = |effect: &dyn Effect| -> Option<Box<dyn Effect>> {
        match effect.form() {
            Some(form) => Some(Box::new(form.clone())),
            None => arm_effect(effect.name(), &setting),
        }
    };
    let mut effects: Vec<Box<dyn Effect>> = model
        .stack
        .effects()
        .filter_map(|(effect, _)| again(effect))
        .collect();
    effects.push(Box::new(form.clone()));
    let mut both = Model::nominal(
        model.robot.clone(),
        EffectStack::new(&model.robot, setting.base, effects),
    );
    both.x[..model.x.len()].copy_from_slice(&model.x);
    both
}
