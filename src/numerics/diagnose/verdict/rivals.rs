//! Causes that no data could tell from a finding.

use crate::criteria::cells::IDENTITY;
use crate::diagnose::types::RivalCause;
use crate::effect::{Form, Survey, moved_with_the_payload};

/// What does the same as a form of the finding in whatever data, as a rival that takes a share of the finding's probability `name`; what may have
/// moved when a payload changed that changes only once, in place of a form that follows the payload, takes half of it. Returns what is left.
pub(super) fn share_with_identities(
    called: &str,
    forms: &[Form],
    survey: &Survey,
    name: f64,
    rivals: &mut Vec<RivalCause>,
) -> f64 {
    let mut left = name;
    let moved = forms
        .iter()
        .filter_map(|form| moved_with_the_payload(form, survey))
        .map(|same| (same, 0.5));
    let same = forms
        .iter()
        .flat_map(|form| form.identities(called))
        .map(|same| (same, *IDENTITY));
    for ((effect, place), share) in moved.chain(same) {
        if !rivals
            .iter()
            .any(|rival| (rival.effect, rival.place) == (effect, place))
        {
            rivals.push(RivalCause {
                effect,
                place,
                delta_bic: 0.0,
                probability: share * left,
            });
            left *= 1.0 - share;
        }
    }
    rivals.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    left
}
