//! Shapes of hypotheses refined: on the grid on which they are proposed the right one may look poor.

use super::{CauseSearch, with};
use crate::criteria::search::FAMILIES;
use crate::diagnose::pool::Beside;
use crate::effect::Hypothesis;
use std::collections::BTreeSet;

impl CauseSearch<'_, '_> {
    /// The set with the best form of every effect that has a shape to refine: on a coarse grid the right one may look poor.
    pub(super) fn shaped(&self, set: &[usize]) -> Vec<Vec<usize>> {
        let given = self.pool.given(set);
        let scored = given.falls.iter().map(|(_, h)| *h).filter(|h| self.can_refine(*h));
        let mut seen = BTreeSet::new();
        let kind = |h: usize| {
            let form = &self.pool.hypotheses[h].form;
            // Bumps, hinges and warm-ups of the unknown are shapes of their own.
            if form.cause().is_nameless() { form.variant() } else { form.name().to_string() }
        };
        let firsts: Vec<usize> = scored.filter(|h| seen.insert(kind(*h))).take(*FAMILIES).collect();
        firsts.into_iter().map(|h| with(set, h)).collect()
    }

    fn can_refine(&self, h: usize) -> bool {
        !self.refined.contains(&h) && !self.pool.hypotheses[h].form.near(self.survey, 0).is_empty()
    }

    /// Variable projection over the shapes of a set's members, of those not refined yet with `new`.
    pub(super) fn refine(&mut self, mut set: Vec<usize>, new: bool) -> Vec<usize> {
        for h in set.clone() {
            if self.pool.hypotheses[h].form.near(self.survey, 0).is_empty() || (new && self.refined.contains(&h)) {
                continue;
            }
            let rest: Vec<usize> = set.iter().copied().filter(|k| *k != h).collect();
            let beside = Beside::of(self.pool, &rest);
            let form = beside.refined(self.pool.hypotheses[h].form.clone(), self.survey);
            let fine = if form == self.pool.hypotheses[h].form {
                h
            } else {
                self.position(Hypothesis { form, ..self.pool.hypotheses[h].clone() })
            };
            self.refined.insert(fine);
            let better = with(&rest, fine);
            if self.pool.bic(&better) < self.pool.bic(&set) - 1e-6 {
                set = better;
            }
        }
        set
    }
}
