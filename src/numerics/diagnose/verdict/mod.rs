//! The verdict: what the last round's causes are called, how probable that is, what is explained by them, before and after on held-out rows,
//! and the residual.

use crate::closed_form::FormulaSearch;
use crate::criteria::judge::FOLDS;
use crate::criteria::noise::{MAX_CHI_SQUARE, MAX_CHI_SQUARE_OF_STRUCTURE, REPEATS};
use crate::criteria::search::SIGNIFICANT;
use crate::criteria::words::{FOUND, NAMELESS, NOT_NOISE};
use crate::effect::{HiddenSize, names};
use crate::estimate::{Model, cross_validate};
use crate::misfit::Misfit;
use crate::observation::Dimension;
use crate::robot::NoiseBasis;
use crate::round::{FitState, Fitter};
use crate::types::{Diagnosis, ErrorLengths, Finding, JointRepeatability, VerdictKind};
use crate::words::{Ground, hidden, slower_than_noise, statement};
use findings::{findings, name_repeated_steps};
use not_observable::{next, not_observable, not_tried, stand_out_in_number};
use std::collections::BTreeMap;

mod doubts;
mod findings;
mod not_observable;
mod windup;

pub(crate) use findings::LastRound;
pub use not_observable::other_means;

/// Draws the conclusions of the last round; `before` is what the base model leaves of every row.
pub(crate) fn conclude(mut last: LastRound, before: &[Option<f64>]) -> Diagnosis {
    let fitter = last.view.fitter;
    let (data, state) = (&fitter.data, &last.state);
    // What is predicted outside of the fitted rows is what is reported, and what programs are corrected with.
    let model = state.model.held_within(data, &state.screening.kept);
    let misfit = Misfit::of(
        fitter.question,
        data,
        &state.screening,
        &model,
        state.fitted.singular.len(),
    );
    name_repeated_steps(&mut last.answer.found);
    let contradicted = doubts::weigh(&mut last, &misfit);
    let state = &last.state;
    let basis = basis(fitter, &state.screening.kept);
    // Repeats know the noise: what poses leave beyond it is no noise, even without structure.
    let lack_of_fit = state
        .fitted
        .repeated
        .as_ref()
        .and_then(|repeated| repeated.lack_of_fit);
    let lacking = basis == NoiseBasis::Repeats
        && lack_of_fit.is_some_and(|(_, chance)| chance <= *SIGNIFICANT);
    let structured = last.answer.nothing_last <= *SIGNIFICANT || lacking;
    let many_aside = stand_out_in_number(&state.screening, data.rows());
    let left_at_fitted_rows = structured && misfit.chi_square > *MAX_CHI_SQUARE_OF_STRUCTURE
        || misfit.chi_square > *MAX_CHI_SQUARE
        || many_aside;
    let something_left = left_at_fitted_rows || misfit.not_carried.is_some();
    let findings = findings(&last, left_at_fitted_rows, something_left);
    let is_stated = data.noise_basis != NoiseBasis::Inferred && basis != NoiseBasis::Repeats;
    let above_stated = is_stated && misfit.beyond_stated > *MAX_CHI_SQUARE_OF_STRUCTURE;
    let verdict = match verdict(&findings, &misfit, something_left, fitter.repeatability) {
        // What lasts from point to point may be the air, and may be a cause that follows time.
        VerdictKind::NothingMissing if above_stated || fitter.correlated.is_some() => {
            VerdictKind::Unexplained
        }
        // A noise that is estimated from the residual cannot explain the residual.
        VerdictKind::Explained if above_stated && basis == NoiseBasis::Inferred => {
            VerdictKind::Unexplained
        }
        other => other,
    };
    let nameless = !something_left && only_unknown(&findings);
    let partly_nameless = !something_left && !nameless && nameless_share(&findings) > *NAMELESS;
    let remarks = [
        many_aside.then_some(
            "more rows stand out than mistakes would, and nothing but the model speaks against them: what is missing may show \
             most there",
        ),
        misfit.not_carried.map(|_| {
            "held-out points are off by more than the fitted ones and the noise allow: something differs there \
             (another time, another region) that the fitted points do not show"
        }),
        contradicted.then_some("held-out points are predicted better without some of the findings, which makes these less probable"),
    ];
    let signature = signature(&last, something_left, remarks);
    let mut not_observable = not_observable(last.survey, &last.view.problem.reach());
    not_observable.extend(not_tried(last.survey, fitter.question.declared));
    not_observable.extend(unseen(&last));
    not_observable.extend(fitter.correlated.map(slower_than_noise));
    let formulas = FormulaSearch {
        state: &last.state,
        view: last.view,
        survey: last.survey,
    }
    .formulas(&findings);
    let LastRound { state, answer, .. } = last;
    // The folds' errors are reported as lengths.
    let lengths = misfit.dimension == Dimension::Length;
    let folds = lengths
        .then(|| cross_validate(&state.session(fitter), *FOLDS, fitter.question.seed))
        .flatten();
    let ground = Ground {
        partly_nameless,
        ..misfit.ground(data, basis, fitter.repeatability.repeats, nameless)
    };
    Diagnosis {
        dimension: misfit.dimension,
        statement: statement(verdict, &ground),
        noise_basis: basis,
        verdict,
        noise_floor: misfit.noise(basis),
        before: ErrorLengths::of(sizes_before(&state, before, &misfit), &misfit.figures),
        after: ErrorLengths::of(&misfit.sizes, &misfit.figures),
        held_out: misfit.held_out,
        folds,
        next_measurements: next(&findings, fitter.question.declared),
        findings: within(findings, &model),
        formulas,
        clock: data.has_clock(),
        not_observable,
        signature,
        leftover_rms: misfit.leftover_rms,
        chi_square: misfit.chi_square,
        gate_first: Some(answer.nothing_first),
        gate_last: Some(answer.nothing_last),
        repeatability: fitter.repeatability,
        located_before: answer.located_first,
        located_after: answer.located_last,
        kept: state.screening.kept.clone(),
        screening: state.screening,
        model,
        fitted: state.fitted,
    }
}

/// What the base model leaves of every row: of a model without a cause the same as what it leaves, by the noise that is known now.
fn sizes_before<'s>(
    state: &FitState,
    before: &'s [Option<f64>],
    misfit: &'s Misfit,
) -> &'s [Option<f64>] {
    match state.causes.is_empty() {
        true => &misfit.sizes,
        false => before,
    }
}

/// The findings with their forms as the model has them.
fn within(mut findings: Vec<Finding>, model: &Model) -> Vec<Finding> {
    for form in findings.iter_mut().flat_map(|finding| &mut finding.forms) {
        let mut known = model
            .stack
            .effects()
            .filter_map(|(effect, _)| effect.form());
        if let Some(known) = known.find(|known| *known == form) {
            *form = known.clone();
        }
    }
    findings
}

/// What the noise rests on: enough repeats, or what is stated where that is all of it.
fn basis(fitter: &Fitter, rows: &[usize]) -> NoiseBasis {
    let JointRepeatability { sigma, repeats } = fitter.repeatability;
    match fitter.data.noise_basis {
        _ if repeats >= *REPEATS && !fitter.infers_repeatability(rows) => NoiseBasis::Repeats,
        _ if sigma > 0.0 => NoiseBasis::Inferred,
        stated => stated,
    }
}

/// The share, in what all findings gain, of those without a name or with one that is more probably wrong.
fn nameless_share(findings: &[Finding]) -> f64 {
    let gains = |counts: &dyn Fn(&Finding) -> bool| -> f64 {
        let counted = findings
            .iter()
            .filter(|finding| finding.is_physics() && counts(finding));
        counted
            .filter_map(|finding| finding.evidence)
            .map(|e| e.gain)
            .sum()
    };
    let unnamed =
        |finding: &Finding| finding.effect == names::UNKNOWN || finding.probabilities.none > 0.5;
    gains(&unnamed) / gains(&|_| true).max(f64::MIN_POSITIVE)
}

/// Whether something was found, and none of it has a name.
fn only_unknown(findings: &[Finding]) -> bool {
    let physics = findings.iter().filter(|finding| finding.is_physics());
    let mut physics = physics.peekable();
    physics.peek().is_some() && physics.all(|finding| finding.effect == names::UNKNOWN)
}

fn verdict(
    findings: &[Finding],
    misfit: &Misfit,
    something_left: bool,
    repeatability: JointRepeatability,
) -> VerdictKind {
    let blind =
        repeatability.repeats < *REPEATS && misfit.noise_floor > *NOT_NOISE * misfit.instrument;
    if blind || something_left || nameless_share(findings) > *NAMELESS {
        VerdictKind::Unexplained
    } else if findings.is_empty() {
        VerdictKind::NothingMissing
    } else {
        VerdictKind::Explained
    }
}

/// The pattern of the residual, where it is not noise, and what else supports it.
fn signature(last: &LastRound, something_left: bool, remarks: [Option<&str>; 3]) -> Option<String> {
    let next = last.answer.next.as_deref().filter(|_| something_left);
    let parts: Vec<&str> = next
        .into_iter()
        .chain(remarks.into_iter().flatten())
        .collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Sentences for causes that could be as large as usual and would not be found, one a cause.
fn unseen(last: &LastRound) -> Vec<String> {
    let mut causes: BTreeMap<&str, (HiddenSize, Vec<String>, f64)> = BTreeMap::new();
    for (form, error) in &last.answer.hidden {
        let Some(hidden) = form.cause().hidden(form, last.survey.robot) else {
            continue;
        };
        // What cannot be seen at all has no standard error.
        let limit = *FOUND * error;
        if limit > hidden.least {
            let (_, subjects, largest) =
                causes
                    .entry(form.name())
                    .or_insert((hidden, Vec::new(), 0.0));
            subjects.push(
                hidden
                    .subject
                    .map_or_else(|| form.place().to_string(), String::from),
            );
            *largest = largest.max(limit);
        }
    }
    causes
        .into_iter()
        .map(|(name, (size, subjects, largest))| hidden(name, &subjects.join(", "), &size, largest))
        .collect()
}
