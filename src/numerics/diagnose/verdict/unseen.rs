//! What the way of a moving arm is too short or too slow to show: there geometry takes up most of what depends on the speed.

use super::last_round::LastRound;
use crate::criteria::words::FOUND;
use crate::diagnose::words::hidden;
use crate::effect::HiddenSize;
use std::collections::BTreeMap;

/// Sentences for causes that could be as large as usual and would not be found, one a cause.
pub(super) fn unseen(last: &LastRound) -> Vec<String> {
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
        .map(|(name, (of, subjects, largest))| hidden(name, &subjects.join(", "), &of, largest))
        .collect()
}
