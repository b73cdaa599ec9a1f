//! Choices that a search made early are undone: members are exchanged, left out, and put more simply.

use super::{CauseSearch, best, decisive, with};
use crate::criteria::search::{EQUIVALENT, SINGLE, WIDE};
use crate::effect::Hypothesis;
use std::collections::BTreeSet;

impl CauseSearch<'_, '_> {
    /// Exchanges members, one, two or all of a place at a time, while the criterion falls: greedy choices are undone.
    pub(super) fn exchange(&mut self, mut set: Vec<usize>) -> Vec<usize> {
        // Free curves have dozens of parameters: with several of them a second look costs minutes and changes little.
        let looks = if self.pool.columns_of(&set).len() > *WIDE { 1 } else { 4 };
        for _ in 0..looks {
            let mut others: BTreeSet<Vec<usize>> = BTreeSet::new();
            let mut gone: BTreeSet<Vec<usize>> = BTreeSet::new();
            for (a, h) in set.iter().enumerate() {
                let place = self.pool.hypotheses[*h].form.place();
                gone.insert(vec![*h]);
                gone.insert(set.iter().copied().filter(|k| self.pool.hypotheses[*k].form.place() == place).collect());
                if set.len() < 7 {
                    gone.extend(set[a + 1..].iter().map(|other| vec![*h, *other]));
                }
            }
            self.pool.leave_out(&set, &gone);
            for gone in gone {
                let rest: Vec<usize> = set.iter().copied().filter(|k| !gone.contains(k)).collect();
                let given = self.pool.given(&rest);
                let many = if gone.len() == 1 { *SINGLE } else { 3 + gone.len() };
                let candidates = best(self.pool, &given, many).into_iter().filter(|h| !gone.contains(h));
                let candidates: Vec<Vec<usize>> = candidates.map(|h| with(&rest, h)).collect();
                // One may stand in for two.
                if gone.len() == 1 && self.stands_in(gone[0]) {
                    for one in
                        candidates.iter().filter(|set| !set.iter().any(|k| !rest.contains(k) && self.stands_in(*k))).take(2)
                    {
                        let given = self.pool.given(one);
                        let second = best(self.pool, &given, 4).into_iter().filter(|h| !self.stands_in(*h));
                        others.extend(second.map(|h| with(one, h)));
                    }
                }
                others.extend(candidates);
                if gone.len() > 1 || set.len() == 1 {
                    let shaped = self.shaped(&rest);
                    others.extend(shaped.into_iter().map(|set| self.refine(set, true)).collect::<Vec<_>>());
                }
            }
            self.pool.forget(std::slice::from_ref(&set));
            let Some(better) = self.ordered(others).into_iter().next() else { break };
            if self.pool.bic(&better) >= self.pool.bic(&set) - 1e-6 {
                break;
            }
            set = self.refine(better, false);
        }
        set
    }

    /// Leaves out members without which the criterion is hardly worse.
    pub(super) fn prune(&self, mut set: Vec<usize>) -> Vec<usize> {
        while !set.is_empty() {
            let without = (0..set.len()).map(|k| {
                let mut rest = set.clone();
                rest.remove(k);
                rest
            });
            let Some(rest) = without.min_by(|a, b| self.pool.bic(a).total_cmp(&self.pool.bic(b))) else { break };
            if self.pool.bic(&rest) >= self.pool.bic(&set) + decisive(set.len()) {
                break;
            }
            set = rest;
        }
        set
    }

    /// Of two laws of one wind-up that explain equally well the simpler stands: proportional to the load.
    pub(super) fn simplest(&self, mut set: Vec<usize>) -> Vec<usize> {
        for h in set.clone() {
            let bent = &self.pool.hypotheses[h].form;
            let Some(simpler) = bent.cause().simpler() else { continue };
            let linear = |other: &Hypothesis| other.form.cause().name() == simpler && other.form.place() == bent.place();
            let Some(simple) = self.pool.hypotheses.iter().position(linear).filter(|simple| !set.contains(simple)) else {
                continue;
            };
            let rest: Vec<usize> = set.iter().copied().filter(|k| *k != h).collect();
            let other = with(&rest, simple);
            if self.pool.bic(&other) < self.pool.bic(&set) + *EQUIVALENT {
                set = other;
            }
        }
        set
    }

    /// Whether a hypothesis may stand in for two others.
    fn stands_in(&self, h: usize) -> bool {
        self.pool.hypotheses[h].form.cause().stands_in_for_two()
    }
}
