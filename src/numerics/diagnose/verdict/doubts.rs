//! Evidence against findings: held-out rows, which lower their probabilities and choose nothing, and the model error of unnamed findings.

use super::LastRound;
use crate::criteria::words::MODEL_ERROR;
use crate::effect::names;
use crate::misfit::Misfit;
use crate::table::FoundCell;

/// Lowers the probabilities of findings by the evidence against them; names, numbers and model stay. Tells whether held-out rows contradict one.
pub(super) fn weigh(last: &mut LastRound, misfit: &Misfit) -> bool {
    let held_out = by_held_out_rows(last, misfit);
    let model_error = by_model_error(&last.answer.found);
    let found = last.answer.found.iter_mut();
    for ((found, held_out), model_error) in found.zip(&held_out).zip(model_error) {
        doubt(found, held_out.min(0.0) + model_error);
    }
    held_out.iter().any(|log_ratio| *log_ratio < 0.0)
}

/// Multiplies the odds of a finding by a likelihood ratio of at most one, given as its ln.
fn doubt(found: &mut FoundCell, log_ratio: f64) {
    let none = found.probabilities.none;
    let there = (1.0 - none) * log_ratio.exp();
    if log_ratio < 0.0 && none < 1.0 && none + there > 0.0 {
        let refuted = none / (none + there);
        found.or_nothing((refuted - none) / (1.0 - none));
    }
}

/// ln of the likelihood ratio of the held-out rows with each finding and without it, all else fitted anew, with the variance of their
/// residuals as that of the noise. Zero where the model predicts these rows nearly as well as the fitted ones.
fn by_held_out_rows(last: &LastRound, misfit: &Misfit) -> Vec<f64> {
    let (fitter, state) = (last.view.fitter, &last.state);
    let log_ratio = |found: &FoundCell| {
        let kept = (0..state.causes.len()).filter(|cause| !found.members.contains(cause));
        let kept = kept.map(|cause| state.causes[cause].clone()).collect();
        let without = fitter.fit(&state.model, kept);
        let rows = &without.screening.kept;
        let model = without.model.held_within(&fitter.data, rows);
        let without = misfit.square_of(&model, &fitter.data);
        0.5 * misfit.values as f64 * (without / misfit.square).ln()
    };
    let found = last.answer.found.iter();
    match misfit.not_carried.is_some() && misfit.is_far_off() {
        true => found.map(log_ratio).collect(),
        false => vec![0.0; found.len()],
    }
}

/// Of each named finding ln of its evidence less the model error of the unnamed ones, where that is more than all of it; else zero.
fn by_model_error(found: &[FoundCell]) -> Vec<f64> {
    let is_nameless = |found: &&FoundCell| found.effect == names::UNKNOWN;
    let nameless: f64 = found.iter().filter(is_nameless).map(|one| one.log).sum();
    let error = *MODEL_ERROR * nameless;
    let of_one = |one: &FoundCell| match one.effect == names::UNKNOWN {
        true => 0.0,
        false => one.log - error,
    };
    found.iter().map(|one| of_one(one).min(0.0)).collect()
}
