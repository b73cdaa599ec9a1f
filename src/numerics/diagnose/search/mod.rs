//! The search for the smallest set of causes that explains what is left: forward in a beam, exchange, merge, prune.

mod exchange;
mod gate;
mod refine;

use super::pool::{CachedHypotheses, Conditional};
use crate::criteria::search::{DECISIVE, FURTHER, SIGNIFICANT};
use crate::effect::{Form, Hypothesis, JointCompliance, Survey, follows, is_named_product, products};
use gate::gate;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// How a search goes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SearchOptions {
    /// Most causes.
    pub most: usize,
    /// Sets followed side by side.
    pub beam: usize,
    /// Draws of the gate.
    pub draws: usize,
    pub seed: u64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self { most: 12, beam: 3, draws: 299, seed: 1 }
    }
}

/// A pool with the survey by which shapes are refined.
pub(crate) struct CauseSearch<'a, 'b> {
    pub pool: &'b mut CachedHypotheses<'a>,
    survey: &'b Survey<'a>,
    /// Pose of each fitted row.
    pose: &'b [usize],
    options: SearchOptions,
    /// Hypotheses whose shape cannot be improved.
    refined: BTreeSet<usize>,
    /// Hypotheses whose products are in the pool.
    multiplied: BTreeSet<usize>,
}

/// What a search found.
pub(crate) struct SearchResult {
    pub set: Vec<usize>,
    /// The gate's probability that the rest is noise, at the start and at the end.
    pub first: f64,
    pub last: f64,
}

impl<'a, 'b> CauseSearch<'a, 'b> {
    pub fn new(pool: &'b mut CachedHypotheses<'a>, survey: &'b Survey<'a>, pose: &'b [usize], options: SearchOptions) -> Self {
        Self { pool, survey, pose, options, refined: BTreeSet::new(), multiplied: BTreeSet::new() }
    }

    /// The probability that what a set of causes, in any order, leaves is noise.
    pub fn gate(&self, set: &[usize]) -> f64 {
        let mut set = set.to_vec();
        set.sort_unstable();
        gate(self.pool, &self.pool.given(&set), self.pose, self.options.draws, self.options.seed)
    }

    /// From a set of causes to the best one. From none it also starts where most arms end, with every joint that yields to its load:
    /// one link that bends may look better than any one joint, and worse than all of them.
    fn run(&mut self, start: Vec<usize>) -> SearchResult {
        let fresh = start.is_empty();
        let mut found = self.climb(start);
        if fresh && !found.set.is_empty() {
            let windups = self.all_windups();
            let other = self.climb(windups);
            // With the prior against every further cause, as they were when it climbed.
            let score = |set: &[usize]| self.pool.bic(set) + *FURTHER * set.len() as f64;
            if score(&other.set) < score(&found.set) {
                found = SearchResult { first: found.first, ..other };
            }
        }
        found.set = self.simplest(found.set);
        found
    }

    /// The wind-up of every joint where it is seen.
    fn all_windups(&self) -> Vec<usize> {
        let given = self.pool.given(&[]);
        let mut keys = BTreeSet::new();
        let seen = given.falls.iter().map(|(_, h)| *h).filter(|h| self.pool.hypotheses[*h].form.is(&JointCompliance));
        let mut set: Vec<usize> = seen.filter(|h| keys.insert(&self.pool.keys[*h])).collect();
        set.sort_unstable();
        set
    }

    fn climb(&mut self, start: Vec<usize>) -> SearchResult {
        let mut best = start;
        if !best.is_empty() {
            best = self.exchange(best);
            best = self.prune(best);
        }
        let mut beam = vec![best.clone()];
        let mut first = None;
        let mut last = 1.0;
        let mut trail = ClimbTrail::default();
        while best.len() < self.options.most && trail.is_new(self.pool.bic(&best)) {
            self.multiply(&best);
            last = self.gate(&best);
            first.get_or_insert(last);
            if last > *SIGNIFICANT {
                break;
            }
            let Some(order) = self.step(&beam) else { break };
            if self.pool.bic(&order[0]) > self.pool.bic(&best) - decisive(best.len() + 1) {
                break;
            }
            best = self.refine(order[0].clone(), false);
            best = self.exchange(best);
            best = self.prune(best);
            let length = best.len();
            beam = order.into_iter().take(self.options.beam).filter(|set| set.len() == length && *set != best).collect();
            beam.insert(0, best.clone());
            beam.truncate(self.options.beam);
            self.pool.forget(&beam);
        }
        if best.len() >= self.options.most {
            last = self.gate(&best);
        }
        SearchResult { set: best, first: first.unwrap_or(last), last }
    }

    /// Puts the products of named causes into the pool.
    fn multiply(&mut self, set: &[usize]) {
        let new: Vec<usize> = set.iter().copied().filter(|h| self.multiplied.insert(*h)).collect();
        let all: Vec<Hypothesis> = new.iter().flat_map(|h| products(&self.pool.hypotheses[*h].form, self.survey)).collect();
        // What the list has a name for is asked under its name.
        let same = |other: &Form, product: &Form| other == product || is_named_product(other, product);
        let fresh = |product: &Hypothesis| !self.pool.hypotheses.iter().any(|other| same(&other.form, &product.form));
        let fresh: Vec<Hypothesis> = all.into_iter().filter(fresh).collect();
        if !fresh.is_empty() {
            self.pool.add(fresh);
        }
    }

    /// Sets with one cause more, best first; refined shapes among them.
    fn step(&mut self, beam: &[Vec<usize>]) -> Option<Vec<Vec<usize>>> {
        let width = self.options.beam;
        let mut next: BTreeSet<Vec<usize>> = BTreeSet::new();
        for set in beam {
            let given = self.pool.given(set);
            next.extend(best(self.pool, &given, 3 * width).into_iter().map(|h| with(set, h)));
        }
        let mut order = self.ordered(next);
        order.truncate(3 * width);
        let mut more: Vec<Vec<usize>> = order.iter().take(4).cloned().collect();
        more.extend(self.shaped(&beam[0]));
        let refined: Vec<Vec<usize>> = more.into_iter().map(|set| self.refine(set, true)).collect();
        let order = self.ordered(order.into_iter().chain(refined).collect());
        (!order.is_empty()).then_some(order)
    }

    fn ordered(&self, sets: BTreeSet<Vec<usize>>) -> Vec<Vec<usize>> {
        let sets: Vec<Vec<usize>> = sets.into_iter().collect();
        let mut order: Vec<(f64, Vec<usize>)> = sets.into_par_iter().map(|set| (self.pool.bic(&set), set)).collect();
        order.retain(|(score, _)| score.is_finite());
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
        order.into_iter().map(|(_, set)| set).collect()
    }

    /// From causes to the best set.
    pub fn run_from<'f>(&mut self, causes: impl Iterator<Item = &'f Form>) -> SearchResult {
        let causes: Vec<&Form> = causes.collect();
        let plain = |form: &&Form| {
            let plain = Hypothesis::new((*form).clone(), 1);
            let product = causes.iter().any(|other| follows(form, other).is_some());
            if product { plain.inheriting() } else { plain }
        };
        let mut start: Vec<usize> = causes.iter().map(|form| self.position(plain(form))).collect();
        start.sort_unstable();
        start.dedup();
        self.run(start)
    }

    /// The hypothesis' position in the pool, where it is put if it is not there.
    fn position(&mut self, hypothesis: Hypothesis) -> usize {
        let same = |other: &Hypothesis| other.form == hypothesis.form;
        match self.pool.hypotheses.iter().position(same) {
            Some(at) => at,
            None => self.pool.add(vec![hypothesis]),
        }
    }
}

/// Where a climb has been, by the criterion. What is pruned may be added again: a climb that comes back is at its end.
#[derive(Default)]
struct ClimbTrail(BTreeSet<u64>);

impl ClimbTrail {
    /// Whether the climb was never there; from now on it was.
    fn is_new(&mut self, bic: f64) -> bool {
        self.0.insert(bic.to_bits())
    }
}

/// The hypotheses that lower the criterion most, one of a key, best first.
fn best(pool: &CachedHypotheses, given: &Conditional, most: usize) -> Vec<usize> {
    let mut keys = BTreeSet::new();
    given.falls.iter().map(|(_, h)| *h).filter(|h| keys.insert(&pool.keys[*h])).take(most).collect()
}

/// What the last of so many causes must lower the criterion by.
fn decisive(causes: usize) -> f64 {
    if causes > 1 { *FURTHER } else { *DECISIVE }
}

fn with(set: &[usize], h: usize) -> Vec<usize> {
    let mut out = set.to_vec();
    out.push(h);
    out.sort_unstable();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_climb_that_adds_and_prunes_the_same_cause_again_and_again_ends() {
        // Adding the second cause makes the first superfluous, pruning that makes room for it again.
        let (criteria, mut at, mut steps) = ([120.0, 80.0, 70.25, 79.5], 0, 0);
        let mut trail = ClimbTrail::default();
        while trail.is_new(criteria[at]) {
            at = if at == 3 { 1 } else { at + 1 };
            steps += 1;
            assert!(steps <= criteria.len(), "the climb goes in a circle");
        }
        assert_eq!((at, steps), (1, 4));
    }
}
