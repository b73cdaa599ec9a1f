//! Findings in a sentence that a mechanic understands.

use crate::diagnose::whitened::AutocorrelatedNoise;
use crate::effect::{HiddenSize, Summary, figure};
use crate::observation::Dimension;

/// A size in the small unit of its dimension, e.g. `31 um`.
pub(crate) fn small(size: f64, dimension: Dimension) -> String {
    format!(
        "{} {}",
        figure(dimension.small().from_si(size), 0),
        dimension.small().symbol()
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
pub(crate) fn hidden(name: &str, subjects: &str, hides: &HiddenSize, limit: f64) -> String {
    let size = if limit.is_finite() {
        format!("by up to {:.1} {}", hides.unit.from_si(limit), hides.unit)
    } else {
        "by any amount".into()
    };
    let advice =
        "geometry absorbs it on this path: measure longer, faster, over the joints' whole range";
    format!("{name}: {subjects} {} {size}; {advice}", hides.may)
}
