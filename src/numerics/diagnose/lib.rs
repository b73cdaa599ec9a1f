//! Diagnosis: where simulation and recording differ, what physics was left out, and how much better the model is with it.
//!
//! The base is the robot as its user believes it: rigid geometry, reduction ratios, declared couplings. Every cause of the library, and every
//! motion of every place over every variable, is projected off it and compared by one evidence; what wins is fitted together with the base in
//! the full model, and everything is looked at again from there, until nothing changes.
//!
//! Before all of it a wrong `setup` is looked for: physics that is found on top of one is none.
//!
//! A `round` looks at the recording around the present model as a `whitened` problem, in which the cells of the `table` of causes are
//! compared; the `verdict` says what is explained, and `words` say it to people.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use calib_engine::linear;
use calib_foundation::{statistics, units};
use calib_numerics::{criteria, effect, error, estimate, observation, robot, spatial};
// Paths are those of the crate `calib`.
use crate as diagnose;

mod closed_form;
mod judge;
mod misfit;
mod outside;
mod regression;
mod round;
mod separate;
mod setup;
pub mod table;
mod types;
mod unasked;
mod verdict;
mod whitened;
mod words;

pub use outside::against_simulation;
pub use round::BASE;
pub use separate::{DiagnosedModel, discrimination_problem};
pub use setup::wrong_setup;
pub use table::{CellAnswer, GivenCell};
pub use types::{
    ClosedForm, Diagnosis, ErrorLengths, Evidence, ExplainedCell, ExplainedShare, Finding,
    JointRepeatability, KnownCell, Located, Probabilities, Question, RivalCause, SETUP,
    SpectrumLine, VerdictKind,
};
pub use verdict::other_means;
pub use words::advised;

use crate::criteria::cells::SETTLED;
use crate::criteria::screen::{MISTAKES, NO_WORSE};
use crate::criteria::search::FEWEST;
use round::{FitState, Fitter, RoundView, correlation_left_by};
use table::{Answer, FoundCell, Rounds, answers, given_causes};
use verdict::{LastRound, conclude};

/// Diagnoses a recording; of very few rows only what the nominal robot makes of them. `tell` receives the progress, a line each. Ask for
/// a [`wrong_setup`] before.
pub fn diagnose(question: &Question, mut tell: impl FnMut(String)) -> Diagnosis {
    if question.fit.len() < *FEWEST {
        return unasked::not_asked(question);
    }
    let first = match Attempt::new(question, false, &mut tell) {
        Ok(first) => first,
        Err(wrong) => return *wrong,
    };
    if first.set_aside() <= *MISTAKES {
        return first.conclude();
    }
    // More rows than mistakes are: a cause that the model lacks may be what moves them, and it is looked for in all rows.
    tell(words::all_rows_text(first.set_aside()));
    let explains = |second: &Attempt| {
        let aside = second.set_aside();
        2 * aside <= first.set_aside()
            && first.set_aside() - aside > *MISTAKES
            && second.leftover() <= *NO_WORSE * first.leftover()
    };
    match Attempt::new(question, true, &mut tell) {
        Ok(second) if explains(&second) => second.conclude(),
        _ => first.conclude(),
    }
}

/// A search until nothing changes.
struct Attempt<'a> {
    fitter: Fitter<'a>,
    /// Errors of all rows by the base model.
    before: Vec<Option<f64>>,
    /// The model around which the last round searched, and the one that it led to.
    now: FitState,
    next: FitState,
    answer: Answer,
}

impl<'a> Attempt<'a> {
    /// Searches with all rows until something is found, or with those that belong; a wrong set-up instead of an attempt.
    fn new(
        question: &'a Question<'a>,
        keeps_all: bool,
        tell: &mut dyn FnMut(String),
    ) -> Result<Self, Box<Diagnosis>> {
        let (mut fitter, mut now) = Fitter::start(question, keeps_all);
        if let Some(wrong) = setup::wrong_when_identified(question, &now) {
            return Err(Box::new(wrong));
        }
        let before = now
            .model
            .error_sizes(&fitter.data, fitter.scale.dimension());
        tell(words::base_text(&now));
        let mut rounds = Rounds::default();
        loop {
            let view = RoundView::of(&now, &fitter);
            let round = rounds.search(&view);
            tell(words::round_text(
                rounds.count(),
                round.cells,
                round.causes.iter().map(|cause| &cause.form),
            ));
            if !round.causes.is_empty() {
                fitter.set_aside();
            }
            let next = fitter.fit(&now.model, round.causes);
            let Some(mut answer) = round.answer else {
                now = next;
                continue;
            };
            // A residual that lasts from row to row of standing points is noise where no further cause would explain it, or where a cause
            // that follows time may be that noise.
            let settled = answer.nothing_last > *SETTLED;
            let asked =
                settled || fitter.data.in_motion(&next.screening.kept) || next.follows_time();
            if let Some(change) = asked
                .then(|| correlation_left_by(&next, &mut answer, &fitter))
                .flatten()
            {
                let kept = fitter.take_correlation(&change, &next);
                tell(words::correlation_text(&fitter));
                now = fitter.fit(&next.model, kept);
                rounds.again();
                continue;
            }
            // A residual that nothing explains may be a noise that is misjudged.
            let quiet = settled || answer.found.is_empty();
            if let Some(sigma) = quiet.then(|| fitter.noise_left_by(&next)).flatten() {
                fitter.learn(sigma);
                now = fitter.fit(&next.model, next.causes);
                rounds.again();
                continue;
            }
            // The search saw a linear picture of each: what comes to nothing in the whole model is not asked again.
            let next = fitter.held_to_a_common_size(next);
            if rounds.again_without(&empty(&next, &answer)) {
                continue;
            }
            // What stretches of a path do not confirm is made of neighbours.
            let found = answer.found.iter().map(|found| found.members.clone());
            let found: Vec<Vec<usize>> = found.collect();
            let unconfirmed = judge::unconfirmed(&next, &found, &fitter);
            if rounds.again_unconfirmed(&unconfirmed, found.concat().len()) {
                continue;
            }
            if rounds.exchange() {
                now = next;
                continue;
            }
            tell(words::conclusions_text(&next));
            return Ok(Self {
                fitter,
                before,
                now,
                next,
                answer,
            });
        }
    }

    /// Rows to fit that are set aside.
    fn set_aside(&self) -> usize {
        self.fitter.question.fit.len() - self.next.screening.kept.len()
    }

    /// Rms error of the fitted rows.
    fn leftover(&self) -> f64 {
        let fitter = &self.fitter;
        let model = &self.next.model;
        let sizes = model.error_sizes(&fitter.data, fitter.scale.dimension());
        let kept = &self.next.screening.kept;
        let squares = kept.iter().filter_map(|row| sizes[*row]);
        let sum: f64 = squares.map(|size| size * size).sum();
        (sum / kept.len().max(1) as f64).sqrt()
    }

    fn conclude(self) -> Diagnosis {
        let view = RoundView::of(&self.now, &self.fitter);
        let survey = view.survey();
        let last = LastRound {
            view: &view,
            survey: &survey,
            state: self.next,
            answer: self.answer,
        };
        conclude(last, &self.before)
    }
}

/// What every cell of the table says of a recording given some of them, for the sum over a fleet; why nothing can be asked of it where that is
/// so.
pub fn cell_evidence(question: &Question, given: &[GivenCell]) -> Result<Vec<CellAnswer>, String> {
    if question.fit.len() < *FEWEST {
        return Err(format!("{} rows to fit are too few", question.fit.len()));
    }
    if let Some(wrong) = wrong_setup(question) {
        return Err(wrong.statement);
    }
    let (mut fitter, mut now) = Fitter::start(question, false);
    if let Some(wrong) = setup::wrong_when_identified(question, &now) {
        return Err(wrong.statement);
    }
    // Around a model without them, then around one with them inside the chain.
    for _ in 0..if given.is_empty() { 0 } else { 2 } {
        let view = RoundView::of(&now, &fitter);
        let causes = given_causes(&view, given);
        now = fitter.fit(&now.model, causes);
    }
    if let Some(sigma) = fitter.noise_left_by(&now) {
        fitter.learn(sigma);
        now = fitter.fit(&now.model, now.causes);
    }
    Ok(answers(&RoundView::of(&now, &fitter), given))
}

/// Causes of findings that are smaller than their own uncertainty in the whole model.
fn empty(state: &FitState, answer: &Answer) -> Vec<usize> {
    let is_empty = |found: &&FoundCell| {
        let size = state.square_size(&found.members);
        state.screening.apart.is_none() && size.is_some_and(|size| size < 1.0)
    };
    let empty = answer.found.iter().filter(is_empty);
    empty.flat_map(|found| found.members.clone()).collect()
}
