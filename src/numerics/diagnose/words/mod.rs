//! The words for what a diagnosis has decided: progress in a line each, findings and the verdict in a sentence each.

mod statement;
mod verdict_statement;

pub(crate) use statement::{hidden, left_out, none_of_the_list, not_so, sentence, slower_than_noise, small, told};
pub(crate) use verdict_statement::{Ground, statement};

use super::pool::CachedHypotheses;
use super::round::{FitState, Fitter};
use super::whitened::AutocorrelatedNoise;
use crate::criteria::words::NAMED;
use crate::effect::Form;
use crate::error::counted;

/// The base model in a line.
pub(crate) fn of_the_base(now: &FitState, fitter: &Fitter) -> String {
    format!(
        "{}, {} of the base model estimated",
        counted(now.screening.kept.len(), "row"),
        counted(fitter.free().len(), "parameter")
    )
}

/// What the noise does from point to point.
pub(crate) fn of_the_correlation(fitter: &Fitter) -> String {
    match fitter.correlated {
        _ if fitter.causes_of_the_arm_first() => {
            "rows follow a path, on which what changes with the pose looks like noise that is correlated from point to point: causes that do \
             not follow time are tried first"
                .into()
        }
        Some(AutocorrelatedNoise { correlation, share }) => format!(
            "noise is correlated from point to point: {:.0} % of its variance by {correlation:.2}; slow causes are judged against it",
            100.0 * share
        ),
        None => "noise is not correlated from point to point".into(),
    }
}

/// What a round begins with in a line.
pub(crate) fn of_the_search(now: &FitState) -> String {
    format!("sets of causes are compared, from {} on", counted(now.causes.len(), "cause"))
}

/// What follows a judgement in a line, once for every change of the model.
pub(crate) fn of_the_open_world(judged: &FitState) -> String {
    format!("what is in no list is asked at every place, beside {} and in their place", counted(judged.causes.len(), "cause"))
}

/// A round in a line, which leaves a residual that noise alone makes with a probability of `rest`.
pub(crate) fn of_a_round<'f>(round: usize, pool: &CachedHypotheses, forms: impl Iterator<Item = &'f Form>, rest: f64) -> String {
    let names: Vec<String> = forms.map(|form| format!("{} at {}", form.name(), form.place())).collect();
    let (tried, causes) = (pool.hypotheses.len(), counted(names.len(), "cause"));
    let mut shown = names.iter().take(*NAMED).cloned().collect::<Vec<_>>().join(", ");
    if names.len() > *NAMED {
        shown.push_str(", ...");
    }
    let shown = if shown.is_empty() { shown } else { format!(" ({shown})") };
    format!("round {round}: {tried} hypotheses, {causes}{shown}; p = {rest:.3} of such a residual from noise alone")
}

/// What follows the last round in a line: folds judge what it found, each cause against so many `rivals`.
pub(crate) fn of_the_judgement(found: &FitState, rivals: usize) -> String {
    let causes = counted(found.causes.len(), "cause");
    format!("rounds end; {causes} judged at poses that a fit did not see, each against at most {rivals} others in its place")
}

/// What follows the judgement in a line.
pub(crate) fn of_the_conclusions(judged: &FitState) -> String {
    format!("{} kept; rivals, probabilities and formulas follow, the last step", counted(judged.causes.len(), "cause"))
}
