//! Of explanations that fit equally well the one stands that carries over to poses that it has not seen.

use super::comparison::ModelComparison;
use super::fold_errors::{FoldErrors, FoldGain};
use crate::diagnose::pool::{CachedHypotheses, EQUIVALENT};
use crate::diagnose::round::{EstimatedCause, FitState};
use crate::effect::{Effect, Place, Unknown};

/// Rivals that are tried in place of a cause.
const RIVALS: usize = 4;

/// Exchanges or drops causes that make the folds worse; `set` holds the causes' positions in the pool, in their order.
pub(super) fn exchange(mut now: FitState, set: &mut Vec<usize>, comparison: &ModelComparison) -> (FitState, Vec<FoldGain>) {
    let ModelComparison { pool, fitter, .. } = *comparison;
    let Some(mut seen) = FoldErrors::of(&now, fitter) else { return (now, Vec::new()) };
    let mut gains = Vec::new();
    let mut done: Vec<(&'static str, Place)> = Vec::new();
    let mut at = 0;
    while at < set.len() {
        let (effect, place) = named(pool, set[at]);
        if done.contains(&(effect, place)) {
            at += 1;
            continue;
        }
        done.push((effect, place));
        let contested = Contested::of((effect, place), set, &now, pool);
        let without = fitter.fit(&now.model, contested.others.clone());
        let Some(bare) = FoldErrors::of(&without, fitter) else { return (now, gains) };
        let harmful = bare.is_better_than(&seen);
        match contested.best_rival(&now, (&seen, harmful), comparison) {
            Some((errors, h, state)) => {
                *set = contested.rest;
                set.push(h);
                let (effect, place) = named(pool, h);
                gains.push(FoldGain { effect, place, gain: errors.gain_over(&bare) });
                (now, seen) = (state, errors);
                at = 0;
            }
            // What has no name must prove itself: it has no physics to carry it to other points.
            None if harmful || effect == Unknown::NAME && seen.gain_over(&bare) < 0.0 => {
                *set = contested.rest;
                (now, seen) = (without, bare);
                at = 0;
            }
            None => {
                gains.push(FoldGain { effect, place, gain: seen.gain_over(&bare) });
                at += 1;
            }
        }
    }
    (now, gains)
}

fn named(pool: &CachedHypotheses, k: usize) -> (&'static str, Place) {
    let form = &pool.hypotheses[k].form;
    (form.name(), form.place())
}

/// The causes of one effect and place, for which others are tried.
struct Contested {
    own: Vec<usize>,
    rest: Vec<usize>,
    /// The causes of `rest`.
    others: Vec<EstimatedCause>,
    /// The criterion of all without the prior of its own.
    fit: f64,
    /// The prior of its own.
    prior_penalty: f64,
}

impl Contested {
    fn of(name: (&'static str, Place), set: &[usize], now: &FitState, pool: &CachedHypotheses) -> Self {
        let (own, rest): (Vec<usize>, Vec<usize>) = set.iter().copied().partition(|k| named(pool, *k) == name);
        let others = set.iter().zip(&now.causes).filter(|(k, _)| rest.contains(k)).map(|(_, cause)| cause.clone()).collect();
        let prior_penalty: f64 = own.iter().map(|k| pool.prior_penalty[*k]).sum();
        Self { own, rest, others, fit: pool.bic(set) - prior_penalty, prior_penalty }
    }

    /// Of rivals that fit equally well the one with the smallest errors in folds, if these convince against what was `seen`.
    fn best_rival(
        &self,
        now: &FitState,
        (seen, harmful): (&FoldErrors, bool),
        comparison: &ModelComparison,
    ) -> Option<(FoldErrors, usize, FitState)> {
        let ModelComparison { pool, fitter, .. } = *comparison;
        let mut rest = self.rest.clone();
        rest.sort_unstable();
        let given = pool.given(&rest);
        let mut tried: Vec<&String> = self.own.iter().map(|k| &pool.keys[*k]).collect();
        let most = tried.len() + RIVALS;
        let mut best: Option<(FoldErrors, usize, FitState)> = None;
        for (_, h) in given.falls.iter().take(60) {
            let mut set = rest.clone();
            set.push(*h);
            set.sort_unstable();
            let prior_penalty = pool.prior_penalty[*h];
            if tried.len() >= most || tried.contains(&&pool.keys[*h]) || pool.bic(&set) - prior_penalty - self.fit > EQUIVALENT {
                continue;
            }
            tried.push(&pool.keys[*h]);
            let coefficients = set.iter().zip(pool.coefficients(&set)).find(|(k, _)| *k == h).map(|(_, own)| own);
            let form = pool.hypotheses[*h].form.clone();
            let rival = EstimatedCause::shrunk(form, pool.problem.robot, coefficients.unwrap_or_default());
            let state = fitter.fit(&now.model, self.others.iter().cloned().chain([rival]).collect());
            // Folds must outweigh what was believed before them; what does harm has lost that right.
            let prejudice = if harmful { 0.0 } else { prior_penalty - self.prior_penalty };
            let convinces = |errors: &FoldErrors| errors.is_better_than(seen) && errors.evidence_against(seen) > prejudice;
            let Some(errors) = FoldErrors::of(&state, fitter).filter(convinces) else { continue };
            if best.as_ref().is_none_or(|(best, ..)| errors.rms() < best.rms()) {
                best = Some((errors, *h, state));
            }
        }
        best
    }
}
