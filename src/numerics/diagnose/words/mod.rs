//! The words for what a diagnosis has decided: progress in a line each, findings and the verdict in a sentence each.
//!
//! Findings in a sentence that a mechanic understands.

use crate::criteria::words::NAMED;
use crate::effect::{Form, HiddenSize, Summary, figure};
use crate::error::counted;
use crate::observation::Dimension;
use crate::round::{FitState, Fitter};
use crate::whitened::AutocorrelatedNoise;
pub(crate) use crate::words::verdict_statement::{Ground, statement};

mod verdict_statement;

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

/// A round in a line.
pub(crate) fn of_a_round<'f>(
    round: usize,
    cells: usize,
    forms: impl Iterator<Item = &'f Form>,
) -> String {
    let mut names: Vec<String> = forms
        .map(|form| format!("{} at {}", form.name(), form.place()))
        .collect();
    names.dedup();
    let causes = counted(names.len(), "cause");
    let mut shown = names
        .iter()
        .take(*NAMED)
        .cloned()
        .collect::<Vec<_>>()
        .join(", ");
    if names.len() > *NAMED {
        shown.push_str(", ...");
    }
    let shown = if shown.is_empty() {
        shown
    } else {
        format!(" ({shown})")
    };
    format!("round {round}: {cells} possible causes compared, {causes}{shown}")
}

/// What follows the last round in a line.
pub(crate) fn of_the_conclusions(found: &FitState) -> String {
    format!(
        "{} in the model; probabilities and formulas follow, the last step",
        counted(found.causes.len(), "cause")
    )
}

/// A size in the small unit of its dimension, e.g. `31 um`.
pub(crate) fn small(size: f64, of: Dimension) -> String {
    format!(
        "{} {}",
        figure(of.small().from_si(size), 0),
        of.small().symbol()
    )
}

/// The sentence of a finding; `rms` is the size of the whole effect in what was measured.
pub(crate) fn sentence(effect: &str, summary: &Summary, rms: &str) -> String {
    let text = summary
        .cause(effect)
        .map_or_else(String::new, |cause| cause.sentence(summary));
    with_size(&text, rms)
}

/// A sentence of a finding as it is in the whole model.
pub(crate) fn with_size(text: &str, rms: &str) -> String {
    format!("{text} ({rms} rms at the tool).")
}

/// The sentence of a finding whose numbers no such effect can have.
pub(crate) fn not_so(effect: &str, summary: &Summary, why: &str, rms: &str) -> String {
    let text = summary
        .cause(effect)
        .map_or_else(String::new, |cause| cause.sentence(summary));
    format!(
        "something unknown acts at {}: {effect} fits best ({text}), but {why} ({rms} rms at the tool).",
        summary.place
    )
}

/// The sentence of a finding whose name the user has excluded.
pub(crate) fn left_out(summary: &Summary, rms: &str) -> String {
    let mut by: Vec<String> = Vec::new();
    for variable in summary.forms.iter().flat_map(|form| form.variables()) {
        let name = summary.clock.named(variable);
        if !by.contains(&name) {
            by.push(name);
        }
    }
    let by = if by.is_empty() {
        String::new()
    } else {
        format!(" and depends on {}", by.join(" and "))
    };
    format!(
        "something unknown acts at {}{by}; the name that it would have is left out by `without` ({rms} rms at the tool).",
        summary.place
    )
}

/// What noise that is correlated from point to point hides.
pub(crate) fn slower_than_noise(noise: AutocorrelatedNoise) -> String {
    format!(
        "small slow causes (drift, steps, warm-up): noise is correlated from point to point ({:.2}), as moving air or a tripod leaves \
         it; measure a fixed target every few poses",
        noise.correlation
    )
}

/// How large a cause may be that a path is too short or too slow to show; `limit` in SI.
pub(crate) fn hidden(name: &str, subjects: &str, of: &HiddenSize, limit: f64) -> String {
    let size = if limit.is_finite() {
        format!("by up to {:.1} {}", of.unit.from_si(limit), of.unit)
    } else {
        "by any amount".into()
    };
    let advice =
        "geometry absorbs it on this path: measure longer, faster, over the joints' whole range";
    format!("{name}: {subjects} {} {size}; {advice}", of.may)
}
