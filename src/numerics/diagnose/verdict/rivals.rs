//! Causes that no data could tell from a finding.

use crate::diagnose::types::RivalCause;
use crate::effect::{Form, Survey, moved_with_the_payload};

/// What may have moved when a payload changed that changes only once, in place of a form that follows the payload: each as probable as the
/// finding, whose probability they share. Returns the share that is left to it.
pub(super) fn share_with_identities(forms: &[Form], survey: &Survey, name: f64, rivals: &mut Vec<RivalCause>) -> f64 {
    let mut alike: Vec<_> = forms.iter().filter_map(|form| moved_with_the_payload(form, survey)).collect();
    alike.dedup();
    alike.retain(|(effect, place)| !rivals.iter().any(|rival| (rival.effect, rival.place) == (*effect, *place)));
    let share = name / (1 + alike.len()) as f64;
    rivals.extend(alike.into_iter().map(|(effect, place)| RivalCause { effect, place, delta_bic: 0.0, probability: share }));
    share
}
