//! Diagnosis: where simulation and recording differ, what physics was left out, and how much better the model is with it.
//!
//! The base is the robot as its user believes it: rigid geometry, reduction ratios, declared couplings. Every cause of the
//! library and form-free signatures are projected off it and compared in one pool; what wins is refitted together with the base
//! on the full model, and everything is looked at again from there, until nothing changes.
//!
//! Before all of it a wrong `setup` is looked for: physics that is found on top of one is none.
//!
//! A `round` looks at the recording around the present model as a `whitened` problem, in which a `search` compares sets of the `pool`;
//! in the end `judge` asks folds of the rows to fit, the `verdict` decides what stands and how it is called, and `words` say so.

mod closed_form;
mod finding_groups;
mod judge;
mod locate;
mod misfit;
mod open_world;
mod outside;
mod pool;
mod round;
mod search;
mod separate;
mod setup;
mod too_few;
mod types;
mod unasked;
mod verdict;
mod whitened;
mod words;

pub use outside::against_simulation;
pub use round::BASE;
pub use separate::{DiagnosedModel, discrimination_problem};
pub use setup::wrong_setup;
pub use types::{
    ClosedForm, Diagnosis, ErrorLengths, Evidence, ExplainedShare, Finding, JointRepeatability, Located, Probabilities, Question,
    RivalCause, SETUP, SpectrumLine, VerdictKind,
};
pub use verdict::other_means;

use crate::criteria::judge::RIVALS;
use crate::criteria::search::{FEWEST, SIGNIFICANT};
use crate::effect::Form;
use judge::{ModelComparison, judge};
use locate::locate;
use round::{EstimatedCause, Fitter, RoundHistory, RoundOutcome, RoundView, correlation_left_by};
use search::{CauseSearch, SearchOptions};
use verdict::{LastRound, conclude};

/// Diagnoses a recording; of very few rows only what the nominal robot makes of them. `tell` receives the progress, a line each. Ask for
/// a [`wrong_setup`] before.
pub fn diagnose(question: &Question, mut tell: impl FnMut(String)) -> Diagnosis {
    if question.fit.len() < *FEWEST {
        return too_few::not_asked(question);
    }
    let (mut fitter, mut now) = Fitter::start(question);
    if let Some(wrong) = setup::wrong_when_identified(question, &now) {
        return wrong;
    }
    let before = now.model.error_sizes(&fitter.data, fitter.scale.dimension());
    tell(words::of_the_base(&now, &fitter));
    let (mut history, mut located, mut first) = (RoundHistory::default(), None, None);
    let mut earlier = None;
    loop {
        tell(words::of_the_search(&now));
        let view = RoundView::of(&now, &fitter);
        let survey = view.survey();
        let mut pool = view.pool(&now, &fitter, &survey, earlier.take());
        located.get_or_insert_with(|| locate(&pool, &pool.given(&[]), &survey));
        let options = SearchOptions { seed: question.seed, ..SearchOptions::default() };
        let mut search = CauseSearch::new(&mut pool, &survey, &view.pose, options);
        let found = search.run_from(now.causes.iter().map(|cause| &cause.form));
        first.get_or_insert(found.first);
        let causes = EstimatedCause::all(&view.problem, search.pool.estimated(&found.set));
        tell(words::of_a_round(history.round(), search.pool, causes.iter().map(|cause| &cause.form), found.last));
        let next = fitter.fit(&now.model, causes);
        let outcome = history.after(&now, &next);
        if outcome == RoundOutcome::Again {
            let forms: Vec<Form> = next.causes.iter().map(|cause| cause.form.clone()).collect();
            earlier = Some(pool.keep(&forms, view.compliance.clone()));
            now = next;
            continue;
        }
        if let Some(change) = correlation_left_by(&next, &fitter) {
            let kept = fitter.take_correlation(&change, &next);
            tell(words::of_the_correlation(&fitter));
            now = fitter.fit(&next.model, kept);
            history = RoundHistory::default();
            continue;
        }
        let structureless = outcome == RoundOutcome::Settled && found.last > *SIGNIFICANT;
        if let Some(sigma) = structureless.then(|| fitter.noise_left_by(&next)).flatten() {
            fitter.learn(sigma);
            now = fitter.fit(&next.model, next.causes);
            continue;
        }
        let next = fitter.held_to_a_common_size(next);
        let comparison = ModelComparison { pool: search.pool, survey: &survey, fitter: &fitter };
        tell(words::of_the_judgement(&next, *RIVALS));
        let judged = judge(next, found.set.clone(), &comparison);
        judged.withdrawn.iter().for_each(|sentence| tell(format!("withdrawn: {sentence}")));
        let settled = open_world::settle(judged, found.last <= *SIGNIFICANT, search.pool, &survey, &fitter, &mut tell);
        let (judged, odds) = (settled.judged, settled.odds);
        tell(words::of_the_conclusions(&judged.state));
        let last = if judged.set == found.set { found.last } else { search.gate(&judged.set) };
        let (first, located) = (first.unwrap_or(1.0), located.unwrap_or_default());
        let without = question.without;
        let round =
            LastRound { pool: search.pool, survey: &survey, judged, odds, scale: fitter.scale, without, first, last, located };
        return conclude(round, &fitter, &before);
    }
}
