//! When rounds of search and refit end.

use super::fit_state::FitState;
use crate::criteria::noise::ROUNDS;
use crate::effect::Form;

/// Rounds so far.
#[derive(Default)]
pub(crate) struct RoundHistory {
    /// Causes that each round found.
    seen: Vec<Vec<Form>>,
}

/// What a round ends with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RoundOutcome {
    /// Something changed: look again from there.
    Again,
    /// The same causes and rows as before.
    Settled,
    /// Whatever came of it.
    Last,
}

impl RoundHistory {
    /// The number of the round that is under way, from 1.
    pub fn round(&self) -> usize {
        self.seen.len() + 1
    }

    /// What comes after a round that began with one model and ended with another.
    pub fn after(&mut self, now: &FitState, next: &FitState) -> RoundOutcome {
        let round = self.round();
        let forms: Vec<Form> = next.causes.iter().map(|cause| cause.form.clone()).collect();
        let same = forms.len() == now.causes.len() && forms.iter().all(|form| now.causes.iter().any(|cause| cause.form == *form));
        // A set that comes back after another goes in circles: both fit equally well.
        let circles = !same && self.seen.contains(&forms);
        self.seen.push(forms);
        if round >= *ROUNDS || circles || now.screening.apart.is_some() {
            RoundOutcome::Last
        } else if same && next.screening.kept == now.screening.kept {
            RoundOutcome::Settled
        } else {
            RoundOutcome::Again
        }
    }
}
