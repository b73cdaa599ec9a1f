//! The words for what a diagnosis has decided: progress in a line each, findings and the verdict in a sentence each.

mod statement;

pub use statement::advised;
pub(crate) use statement::{
    Ground, hidden, left_out, not_so, sentence, slower_than_noise, small, statement, with_size,
};

use super::round::{FitState, Fitter};
use super::whitened::AutocorrelatedNoise;
use crate::criteria::words::NAMED;
use crate::effect::Form;
use crate::error::counted;

/// The base model in a line.
pub(crate) fn base_text(now: &FitState) -> String {
    format!(
        "{}, which determine {} of the base model",
        counted(now.screening.kept.len(), "row"),
        counted(now.fitted.singular.len(), "number")
    )
}

/// What the noise does from point to point.
pub(crate) fn correlation_text(fitter: &Fitter) -> String {
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

/// A round in a line.
pub(crate) fn round_text<'f>(
    round: usize,
    cells: usize,
    forms: impl Iterator<Item = &'f Form>,
) -> String {
    let mut names: Vec<String> = forms
        .map(|form| format!("{} at {}", form.name(), form.place()))
        .collect();
    names.dedup();
    let causes = counted(names.len(), "cause");
    let mut shown = names[..names.len().min(*NAMED)].join(", ");
    if names.len() > *NAMED {
        shown.push_str(", ...");
    }
    if !shown.is_empty() {
        shown = format!(" ({shown})");
    }
    format!("round {round}: {cells} possible causes compared, {causes}{shown}")
}

/// Why it is searched again, in a line.
pub(crate) fn all_rows_text(aside: usize) -> String {
    format!(
        "{} stand out: searched again with all rows",
        counted(aside as u64, "row")
    )
}

/// What follows the last round in a line.
pub(crate) fn conclusions_text(found: &FitState) -> String {
    format!(
        "{} in the model; probabilities and formulas follow, the last step",
        counted(found.causes.len(), "cause")
    )
}
