//! The search for the smallest set of causes that explains what is left: forward in a beam, exchange, merge, prune.

use super::gate::gate;
use super::pool::{Pool, dot, project};
use super::state::{State, solve, span};
use crate::effect::{Effect, Form, Hypothesis, JointCompliance, JointHardening, JointTable, LinkCompliance, Survey};
use faer::Mat;
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

/// The first cause must lower the criterion by this much: strong evidence (Kass and Raftery, 1995), and the gate judges it too.
const DECISIVE: f64 = 8.0;
/// A further one by more: the shape of the first is never quite the true one, and what is left of it imitates others.
const FURTHER: f64 = 16.0;
/// Sets with more numbers than this are wide.
const WIDE: usize = 60;
/// Levels of refinement, and how many may bring nothing.
const LEVELS: i32 = 10;
const IDLE: usize = 3;
/// Candidates in place of a single member.
const SINGLE: usize = 8;
/// Families of shapes that are refined before candidates are compared.
const FAMILIES: usize = 5;

/// A pool with the survey by which shapes are refined.
pub(crate) struct Search<'a, 'b> {
    pub pool: &'b mut Pool<'a>,
    pub survey: &'b Survey<'a>,
    /// Pose of each fitted row.
    pub pose: &'b [usize],
    pub options: SearchOptions,
    /// Hypotheses whose shape cannot be improved.
    refined: BTreeSet<usize>,
}

/// What a search found.
pub(crate) struct Found {
    pub set: Vec<usize>,
    /// The gate's probability that the rest is noise, at the start and at the end.
    pub first: f64,
    pub last: f64,
}

impl<'a, 'b> Search<'a, 'b> {
    pub fn new(pool: &'b mut Pool<'a>, survey: &'b Survey<'a>, pose: &'b [usize], options: SearchOptions) -> Self {
        Self { pool, survey, pose, options, refined: BTreeSet::new() }
    }

    /// The probability that what a set of causes, in any order, leaves is noise.
    pub fn gate(&self, set: &[usize]) -> f64 {
        let mut set = set.to_vec();
        set.sort_unstable();
        gate(self.pool, &self.pool.state(&set), self.pose, self.options.draws, self.options.seed)
    }

    /// From a set of causes to the best one. From none it also starts where most arms end, with every joint that yields to its load:
    /// one link that bends may look better than any one joint, and worse than all of them.
    pub fn run(&mut self, start: Vec<usize>) -> Found {
        let fresh = start.is_empty();
        let mut found = self.climb(start);
        if fresh && !found.set.is_empty() {
            let yielding = self.all_yielding();
            let other = self.climb(yielding);
            // With the prior against every further cause, as they were when it climbed.
            let score = |set: &[usize]| self.pool.bic(set) + FURTHER * set.len() as f64;
            if score(&other.set) < score(&found.set) {
                found = Found { first: found.first, ..other };
            }
        }
        found.set = self.simplest(found.set);
        found
    }

    /// The wind-up of every joint where it is seen.
    fn all_yielding(&self) -> Vec<usize> {
        let state = self.pool.state(&[]);
        let seen = state.falls(self.pool).iter().map(|(_, h)| *h);
        let mut set: Vec<usize> = seen.filter(|h| self.pool.hypotheses[*h].form.is(&JointCompliance)).collect();
        set.sort_unstable();
        set
    }

    fn climb(&mut self, start: Vec<usize>) -> Found {
        let mut best = start;
        if !best.is_empty() {
            best = self.exchange(best);
            best = self.prune(best);
        }
        let mut states = vec![best.clone()];
        let mut first = None;
        let mut last = 1.0;
        while best.len() < self.options.most {
            last = self.gate(&best);
            first.get_or_insert(last);
            if last > super::SIGNIFICANT {
                break;
            }
            let Some(order) = self.step(&states) else { break };
            if self.pool.bic(&order[0]) > self.pool.bic(&best) - decisive(best.len() + 1) {
                break;
            }
            best = self.refine(order[0].clone(), false);
            best = self.exchange(best);
            best = self.prune(best);
            let length = best.len();
            states = order.into_iter().take(self.options.beam).filter(|set| set.len() == length && *set != best).collect();
            states.insert(0, best.clone());
            states.truncate(self.options.beam);
            self.pool.forget(&states);
        }
        if best.len() >= self.options.most {
            last = self.gate(&best);
        }
        Found { set: best, first: first.unwrap_or(last), last }
    }

    /// Of two laws of one wind-up that explain alike the simpler stands: proportional to the load.
    fn simplest(&self, mut set: Vec<usize>) -> Vec<usize> {
        for h in set.clone() {
            let bent = &self.pool.hypotheses[h].form;
            if !bent.is(&JointHardening) {
                continue;
            }
            let linear = |other: &Hypothesis| other.form.is(&JointCompliance) && other.form.place() == bent.place();
            let Some(simple) = self.pool.hypotheses.iter().position(linear).filter(|simple| !set.contains(simple)) else {
                continue;
            };
            let rest: Vec<usize> = set.iter().copied().filter(|k| *k != h).collect();
            let other = with(&rest, simple);
            if self.pool.bic(&other) < self.pool.bic(&set) + super::ALIKE {
                set = other;
            }
        }
        set
    }

    /// Sets with one cause more, best first; refined shapes among them.
    fn step(&mut self, states: &[Vec<usize>]) -> Option<Vec<Vec<usize>>> {
        let beam = self.options.beam;
        let mut next: BTreeSet<Vec<usize>> = BTreeSet::new();
        for set in states {
            let state = self.pool.state(set);
            next.extend(best(self.pool, &state, 3 * beam).into_iter().map(|h| with(set, h)));
        }
        let mut order = self.ordered(next);
        order.truncate(3 * beam);
        let mut more: Vec<Vec<usize>> = order.iter().take(4).cloned().collect();
        more.extend(self.shaped(&states[0]));
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

    /// The set with the best form of every effect that has a shape to refine: on a coarse grid the right one may look poor.
    fn shaped(&self, set: &[usize]) -> Vec<Vec<usize>> {
        let state = self.pool.state(set);
        let scored = state.falls(self.pool).iter().map(|(_, h)| *h).filter(|h| self.can_refine(*h));
        let mut seen = BTreeSet::new();
        let kind = |h: usize| {
            let form = &self.pool.hypotheses[h].form;
            // Bumps, hinges and warm-ups of the unknown are shapes of their own.
            if form.cause().is_nameless() { form.variant() } else { form.name().to_string() }
        };
        let firsts: Vec<usize> = scored.filter(|h| seen.insert(kind(*h))).take(FAMILIES).collect();
        firsts.into_iter().map(|h| with(set, h)).collect()
    }

    /// Whether a hypothesis may stand in for two others: a free curve, or the bending of a link for two joints' wind-up.
    fn stands_in(&self, h: usize) -> bool {
        let form = &self.pool.hypotheses[h].form;
        form.cause().is_nameless() || form.is(&JointTable) || form.is(&LinkCompliance)
    }

    fn can_refine(&self, h: usize) -> bool {
        !self.refined.contains(&h) && !self.pool.hypotheses[h].form.near(self.survey, 0).is_empty()
    }

    /// Variable projection over the shapes of a set's members, of those not refined yet with `new`.
    fn refine(&mut self, mut set: Vec<usize>, new: bool) -> Vec<usize> {
        for h in set.clone() {
            if self.pool.hypotheses[h].form.near(self.survey, 0).is_empty() || (new && self.refined.contains(&h)) {
                continue;
            }
            let rest: Vec<usize> = set.iter().copied().filter(|k| *k != h).collect();
            let beside = span(self.pool, &self.pool.columns_of(&rest));
            let mut residual = self.pool.residual.clone();
            project(beside.as_ref(), &mut residual);
            let mut form = self.pool.hypotheses[h].form.clone();
            let mut most = self.gain(&form, &beside, &residual);
            let mut idle = 0;
            for level in 0..LEVELS {
                let near = form.near(self.survey, level).into_par_iter();
                let near: Vec<(f64, Form)> = near.map(|form| (self.gain(&form, &beside, &residual), form)).collect();
                match near.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some((gain, other)) if gain > most * (1.0 + 1e-9) => (most, form) = (gain, other),
                    _ => idle += 1,
                }
                if idle >= IDLE {
                    break;
                }
            }
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

    /// The hypothesis' position in the pool, where it is put if it is not there.
    pub fn position(&mut self, hypothesis: Hypothesis) -> usize {
        let same = |other: &Hypothesis| other.form == hypothesis.form;
        match self.pool.hypotheses.iter().position(same) {
            Some(at) => at,
            None => self.pool.add(vec![hypothesis]),
        }
    }

    /// By how much a form would lower the squared `residual` beside what the columns of `beside` span.
    fn gain(&self, form: &Form, beside: &Mat<f64>, residual: &[f64]) -> f64 {
        let lines = self.pool.lines;
        let mut columns = self.pool.lens.columns(form);
        for column in columns.chunks_mut(lines) {
            let norm = dot(column, column).sqrt().max(1e-300);
            column.iter_mut().for_each(|value| *value /= norm);
        }
        project(self.pool.base.as_ref(), &mut columns);
        project(beside.as_ref(), &mut columns);
        super::state::gain(&columns, lines, residual)
    }

    /// Exchanges members, one, two or all of a place at a time, while the criterion falls: greedy choices are undone.
    fn exchange(&mut self, mut set: Vec<usize>) -> Vec<usize> {
        // Free curves have dozens of numbers: with several of them a second look costs minutes and changes little.
        let looks = if self.pool.columns_of(&set).len() > WIDE { 1 } else { 4 };
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
            for gone in gone {
                let rest: Vec<usize> = set.iter().copied().filter(|k| !gone.contains(k)).collect();
                let state = self.pool.state(&rest);
                let many = if gone.len() == 1 { SINGLE } else { 3 + gone.len() };
                let candidates = best(self.pool, &state, many).into_iter().filter(|h| !gone.contains(h));
                let candidates: Vec<Vec<usize>> = candidates.map(|h| with(&rest, h)).collect();
                // One may stand in for two.
                if gone.len() == 1 && self.stands_in(gone[0]) {
                    for one in
                        candidates.iter().filter(|set| !set.iter().any(|k| !rest.contains(k) && self.stands_in(*k))).take(2)
                    {
                        let state = self.pool.state(one);
                        let second = best(self.pool, &state, 4).into_iter().filter(|h| !self.stands_in(*h));
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
    fn prune(&self, mut set: Vec<usize>) -> Vec<usize> {
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

    /// Coefficients of every member of a set.
    pub fn coefficients(&self, set: &[usize]) -> Vec<Vec<f64>> {
        let solution = solve(self.pool, set);
        let mut all = solution.coefficients.into_iter();
        set.iter().map(|k| all.by_ref().take(self.pool.first[k + 1] - self.pool.first[*k]).collect()).collect()
    }
}

/// The hypotheses that lower the criterion most, one of a key, best first.
pub(crate) fn best(pool: &Pool, state: &State, most: usize) -> Vec<usize> {
    let mut keys = BTreeSet::new();
    state.falls(pool).iter().map(|(_, h)| *h).filter(|h| keys.insert(&pool.keys[*h])).take(most).collect()
}

/// What the last of so many causes must be worth.
fn decisive(causes: usize) -> f64 {
    if causes > 1 { FURTHER } else { DECISIVE }
}

fn with(set: &[usize], h: usize) -> Vec<usize> {
    let mut out = set.to_vec();
    out.push(h);
    out.sort_unstable();
    out
}
