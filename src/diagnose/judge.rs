//! Held-out rows judge: what each finding is worth there, and which of two explanations that fit alike carries over.

use super::pool::Pool;
use super::{ALIKE, Chosen, Course, Question, fitted, held_down, start_of};
use crate::effect::{Effect, Form, Place, Unknown};
use crate::estimate::rows_alike;
use crate::robot::Measurements;
use std::collections::BTreeMap;

/// Causes of one effect and place, as positions among the chosen; what the held-out rms (m) falls by with them.
#[derive(Debug, Clone)]
pub(crate) struct Worth {
    pub effect: &'static str,
    pub place: Place,
    pub gain: f64,
}

/// A model that is worse on held-out rows by this share, and by so many standard errors, is worse.
const WORSE: f64 = 0.03;
const CLEARLY: f64 = 2.0;
/// Without a share that matters it takes more: every finding is asked.
const BEYOND_DOUBT: f64 = 3.0;
/// Rivals that are tried in place of a cause.
const RIVALS: usize = 4;

/// Held-out rows that belong.
pub(super) struct HeldOut {
    /// Squared errors, m2, by row.
    squares: BTreeMap<usize, f64>,
    /// Whether they lie along a path.
    moving: bool,
}

impl HeldOut {
    /// `None` where no row is held out.
    pub fn of(now: &Course, data: &Measurements, question: &Question) -> Option<Self> {
        let aside = |row: &usize| now.screening.suspects.iter().any(|s| s.row == *row && !s.used());
        let predicted = now.model.predict(data);
        let rows = question.validate.iter().filter(|row| !aside(row));
        let squares: BTreeMap<usize, f64> =
            rows.map(|row| (*row, (data.position[*row] - predicted[*row]).norm_squared())).collect();
        (!squares.is_empty()).then(|| Self { squares, moving: data.in_motion(question.validate) })
    }

    pub fn rms(&self) -> f64 {
        (self.squares.values().sum::<f64>() / self.squares.len() as f64).sqrt()
    }

    /// -2 ln of the odds of `other` against this, by these rows.
    fn evidence_against(&self, other: &Self) -> f64 {
        2.0 * 3.0 * self.squares.len() as f64 * (other.rms() / self.rms()).ln()
    }

    /// Whether this is better than `other` by a share that matters, and by more than the rows' scatter would have it.
    fn is_better_than(&self, other: &Self) -> bool {
        self.rms() < other.rms() * (1.0 - WORSE) && self.fall_from(other) > CLEARLY
    }

    /// Whether this is better than `other`, by however little, beyond what the rows' scatter would have.
    pub fn is_beyond_doubt_better_than(&self, other: &Self) -> bool {
        self.fall_from(other) > BEYOND_DOUBT
    }

    /// By how many standard errors squared errors are smaller than those of `other`.
    fn fall_from(&self, other: &Self) -> f64 {
        let falls: Vec<f64> = self.squares.iter().filter_map(|(row, own)| Some(other.squares.get(row)? - own)).collect();
        let count = falls.len() as f64;
        let mean = falls.iter().sum::<f64>() / count;
        let variance = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
        // Rows along a path are not as many opinions as there are rows.
        let off: Vec<f64> = falls.iter().map(|fall| fall - mean).collect();
        let count = if self.moving { count / rows_alike(&off, 1) } else { count };
        let error = (variance / count).sqrt();
        if error.is_nan() { 0.0 } else { mean / error.max(f64::MIN_POSITIVE) }
    }
}

/// Exchanges or drops causes that make held-out rows worse; `set` holds the chosen causes' positions in the pool, in their order.
pub(crate) fn judge(
    mut now: Course,
    set: &mut Vec<usize>,
    pool: &Pool,
    free: &[usize],
    rigid: usize,
    data: &Measurements,
    question: &Question,
) -> (Course, Vec<Worth>) {
    let Some(mut seen) = HeldOut::of(&now, data, question) else { return (now, Vec::new()) };
    let refit = |now: &Course, chosen: &[Chosen]| fitted((&now.model, rigid), Some(free), chosen, data, question);
    let mut worths = Vec::new();
    let mut at = 0;
    let mut done: Vec<(&'static str, Place)> = Vec::new();
    while at < set.len() {
        let form = &pool.hypotheses[set[at]].form;
        let group = (form.name(), form.place());
        if done.contains(&group) {
            at += 1;
            continue;
        }
        done.push(group);
        let all = start_of(&now);
        let is_own = |k: &usize| {
            let form = &pool.hypotheses[*k].form;
            form.name() == group.0 && form.place() == group.1
        };
        let rest: Vec<usize> = set.iter().copied().filter(|k| !is_own(k)).collect();
        let others: Vec<Chosen> = set.iter().zip(&all).filter(|(k, _)| !is_own(k)).map(|(_, cause)| cause.clone()).collect();
        let without = refit(&now, &others);
        let Some(bare) = HeldOut::of(&without, data, question) else { return (now, worths) };
        let mut best: Option<(HeldOut, usize, Course)> = None;
        let harmful = bare.is_better_than(&seen);
        let belief: f64 = set.iter().filter(|k| is_own(k)).map(|k| pool.charge[*k]).sum();
        let fit = pool.bic(set) - belief;
        let mut sorted = rest.clone();
        sorted.sort_unstable();
        let state = pool.state(&sorted);
        let mut tried: Vec<&String> = set.iter().filter(|k| is_own(k)).map(|k| &pool.keys[*k]).collect();
        let most = tried.len() + RIVALS;
        for (_, h) in state.falls(pool).iter().take(60) {
            let rival = &pool.hypotheses[*h].form;
            let mut other = sorted.clone();
            other.push(*h);
            other.sort_unstable();
            if tried.len() >= most || tried.contains(&&pool.keys[*h]) || pool.bic(&other) - pool.charge[*h] - fit > ALIKE {
                continue;
            }
            tried.push(&pool.keys[*h]);
            let mut chosen = others.clone();
            chosen.push(start(pool, &other, *h, rival));
            let course = refit(&now, &chosen);
            // Held-out rows must outweigh what was believed before them; what does harm has lost that right.
            let prejudice = if harmful { 0.0 } else { pool.charge[*h] - belief };
            let convinces = |other: &HeldOut| other.is_better_than(&seen) && other.evidence_against(&seen) > prejudice;
            let Some(other) = HeldOut::of(&course, data, question).filter(convinces) else { continue };
            if best.as_ref().is_none_or(|(best, ..)| other.rms() < best.rms()) {
                best = Some((other, *h, course));
            }
        }
        match best {
            Some((other, h, course)) => {
                *set = rest;
                set.push(h);
                worths.push(worth(&pool.hypotheses[h].form, bare.rms() - other.rms()));
                (now, seen) = (course, other);
                at = 0;
            }
            // What has no name must prove itself: it has no physics to carry it to other points.
            None if harmful || group.0 == Unknown::NAME && bare.rms() < seen.rms() => {
                *set = rest;
                (now, seen) = (without, bare);
                at = 0;
            }
            None => {
                worths.push(Worth { effect: group.0, place: group.1, gain: bare.rms() - seen.rms() });
                at += 1;
            }
        }
    }
    (now, worths)
}

fn worth(form: &Form, gain: f64) -> Worth {
    Worth { effect: form.name(), place: form.place(), gain }
}

/// A hypothesis with its coefficients in a set.
fn start(pool: &Pool, set: &[usize], h: usize, form: &Form) -> Chosen {
    let solution = super::state::solve(pool, set);
    let mut at = 0;
    for k in set.iter().take_while(|k| **k != h) {
        at += pool.first[k + 1] - pool.first[*k];
    }
    let count = pool.first[h + 1] - pool.first[h];
    let coefficients = solution.coefficients[at..at + count].to_vec();
    Chosen { form: form.clone(), known: held_down(form, pool.lens.robot, &coefficients), coefficients }
}
