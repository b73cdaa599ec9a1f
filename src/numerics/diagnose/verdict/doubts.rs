//! What speaks against the name of a finding: the held-out rows, which judge how probable it is and choose nothing, and a curve without a name
//! beside it that is only nearly right.

use super::LastRound;
use crate::criteria::words::NEARLY_RIGHT;
use crate::effect::names;
use crate::misfit::Misfit;
use crate::table::FoundCell;

/// Lowers the probabilities of findings by what speaks against them; names, numbers and model stay.
pub(super) fn weigh(last: &mut LastRound, misfit: &Misfit) {
    let held_out = by_held_out_rows(last, misfit);
    let beside = beside_nameless(&last.answer.found);
    let found = last.answer.found.iter_mut();
    for ((found, held_out), beside) in found.zip(held_out).zip(beside) {
        doubt(found, held_out.min(0.0) + beside);
    }
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

/// ln of the likelihood ratio of the held-out rows with each finding and without it, everything else fitted anew, the noise being what is left
/// of them. Zero where the model is nearly what was recorded there.
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

/// ln of what the misfit of curves without a name takes of the evidence of each named finding, where it takes all of that; else zero.
fn beside_nameless(found: &[FoundCell]) -> Vec<f64> {
    let is_nameless = |found: &&FoundCell| found.effect == names::UNKNOWN;
    let nameless: f64 = found.iter().filter(is_nameless).map(|one| one.log).sum();
    let taken = *NEARLY_RIGHT * nameless;
    let of_one = |one: &FoundCell| match one.effect == names::UNKNOWN {
        true => 0.0,
        false => one.log - taken,
    };
    found.iter().map(|one| of_one(one).min(0.0)).collect()
}
