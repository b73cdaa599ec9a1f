//! Of explanations that fit equally well the one stands that carries over to poses that it has not seen.

use super::alternatives::Alternatives;
use super::comparison::{ModelComparison, others};
use super::fold_errors::{FoldErrors, FoldGain};
use crate::criteria::judge::RIVALS;
use crate::criteria::search::EQUIVALENT;
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{EstimatedCause, FitState};
use crate::effect::{Place, follows, names};

/// Exchanges or drops causes that make the folds worse; `set` holds the causes' positions in the pool, in their order.
pub(super) fn exchange(mut now: FitState, set: &mut Vec<usize>, comparison: &ModelComparison) -> (FitState, Vec<FoldGain>) {
    let ModelComparison { pool, fitter, .. } = *comparison;
    let Some(mut seen) = FoldErrors::of(&now, fitter) else { return (now, Vec::new()) };
    let mut gains = Vec::new();
    let mut done: Vec<(&'static str, Place)> = Vec::new();
    let mut at = 0;
    while at < set.len() {
        if at == 0 {
            // All that are asked about are left out of the same set.
            let mut all = set.clone();
            all.sort_unstable();
            let of = |k: &usize| Contested::of(named(pool, *k), &all, pool).own;
            pool.leave_out(&all, &all.iter().map(of).collect());
        }
        let (effect, place) = named(pool, set[at]);
        if done.contains(&(effect, place)) {
            at += 1;
            continue;
        }
        done.push((effect, place));
        let contested = Contested::of((effect, place), set, pool);
        let rivals = contested.rivals(pool);
        match contested.outcome(&now, &seen, &rivals, comparison) {
            Outcome::Unknown => return (now, gains),
            Outcome::Stands(gain) => {
                gains.push(FoldGain { effect, place, gain });
                at += 1;
            }
            Outcome::Dropped(state, errors) => {
                *set = contested.rest;
                // Gains were those of a model that is gone.
                gains.clear();
                (now, seen) = (*state, errors);
                at = 0;
            }
            Outcome::Exchanged { state, errors, with, gain } => {
                *set = contested.rest;
                set.push(with);
                let (effect, place) = named(pool, with);
                gains.clear();
                gains.push(FoldGain { effect, place, gain });
                (now, seen) = (*state, errors);
                at = 0;
            }
        }
    }
    (now, gains)
}

fn named(pool: &CachedHypotheses, k: usize) -> (&'static str, Place) {
    let form = &pool.hypotheses[k].form;
    (form.name(), form.place())
}

/// What becomes of the causes of one effect and place.
enum Outcome {
    /// The poses are too few for folds.
    Unknown,
    /// They stand, and lower the rms of the folds by this, m.
    Stands(f64),
    Dropped(Box<FitState>, FoldErrors),
    /// A rival stands in their place, by its position in the pool.
    Exchanged {
        state: Box<FitState>,
        errors: FoldErrors,
        with: usize,
        gain: f64,
    },
}

/// Another cause in place of the contested ones.
struct RivalOf {
    /// Its position in the pool.
    at: usize,
    cause: EstimatedCause,
    prior_penalty: f64,
}

/// The causes of one effect and place, for which others are tried.
struct Contested {
    effect: &'static str,
    /// Their positions among the causes.
    members: Vec<usize>,
    own: Vec<usize>,
    rest: Vec<usize>,
    /// The criterion of all without the prior of its own.
    fit: f64,
    /// The prior of its own.
    prior_penalty: f64,
}

impl Contested {
    fn of(name: (&'static str, Place), set: &[usize], pool: &CachedHypotheses) -> Self {
        let form = |k: usize| &pool.hypotheses[k].form;
        let named: Vec<usize> = set.iter().copied().filter(|k| named(pool, *k) == name).collect();
        // A product is contested together with the law that it is made of.
        let contested = |k: usize| named.contains(&k) || named.iter().any(|own| follows(form(k), form(*own)).is_some());
        let members: Vec<usize> = (0..set.len()).filter(|i| contested(set[*i])).collect();
        let (own, rest): (Vec<usize>, Vec<usize>) = set.iter().copied().partition(|k| contested(*k));
        let prior_penalty: f64 = own.iter().map(|k| pool.prior_penalty[*k]).sum();
        Self { effect: name.0, members, own, rest, fit: pool.bic(set) - prior_penalty, prior_penalty }
    }

    /// Causes that fit as well in their place.
    fn rivals(&self, pool: &CachedHypotheses) -> Vec<RivalOf> {
        let mut rest = self.rest.clone();
        rest.sort_unstable();
        let given = pool.given(&rest);
        let mut tried: Vec<&String> = self.own.iter().map(|k| &pool.keys[*k]).collect();
        let mut rivals = Vec::new();
        for (_, h) in given.falls.iter().take(60) {
            let mut set = rest.clone();
            set.push(*h);
            set.sort_unstable();
            let prior_penalty = pool.prior_penalty[*h];
            if tried.contains(&&pool.keys[*h]) || pool.bic(&set) - prior_penalty - self.fit > *EQUIVALENT {
                continue;
            }
            tried.push(&pool.keys[*h]);
            let coefficients = set.iter().zip(pool.coefficients(&set)).find(|(k, _)| *k == h).map(|(_, own)| own);
            let form = pool.hypotheses[*h].form.clone();
            let cause = EstimatedCause::shrunk(form, pool.problem.robot, coefficients.unwrap_or_default());
            rivals.push(RivalOf { at: *h, cause, prior_penalty });
            if rivals.len() == *RIVALS {
                break;
            }
        }
        rivals
    }

    /// Of rivals that fit equally well the one with the smallest errors in folds comes in, if these convince against what was `seen`.
    fn outcome(&self, now: &FitState, seen: &FoldErrors, rivals: &[RivalOf], comparison: &ModelComparison) -> Outcome {
        let fitter = comparison.fitter;
        let causes: Vec<EstimatedCause> = rivals.iter().map(|rival| rival.cause.clone()).collect();
        let Some(alternatives) = Alternatives::of(now, fitter, &causes) else { return Outcome::Unknown };
        let nearby = alternatives.near();
        let fitted = |rival: Option<usize>| {
            let rival = rival.map(|k| causes[k].clone());
            let state = fitter.fit(&now.model, others(now, &self.members).into_iter().chain(rival).collect());
            let errors = FoldErrors::of(&state, fitter)?;
            Some((Box::new(state), errors))
        };
        let look = |rival: Option<usize>| {
            let near = nearby.as_ref().and_then(|near| near.errors(&self.members, rival));
            near.or_else(|| fitted(rival).map(|(_, errors)| errors))
        };
        let Some(bare) = look(None) else { return Outcome::Unknown };
        // What has no name must prove itself: it has no physics to carry it to other points.
        let harmful = |bare: &FoldErrors| bare.is_better_than(seen);
        let useless = |bare: &FoldErrors| harmful(bare) || self.effect == names::UNKNOWN && seen.gain_over(bare) < 0.0;
        // Folds must outweigh what was believed before them; what does harm has lost that right.
        let convinces = |rival: &RivalOf, errors: &FoldErrors| {
            let prejudice = if harmful(&bare) { 0.0 } else { rival.prior_penalty - self.prior_penalty };
            errors.is_better_than(seen) && errors.evidence_against(seen) > prejudice
        };
        let mut better: Vec<(f64, usize)> = (0..rivals.len())
            .filter_map(|k| look(Some(k)).filter(|errors| convinces(&rivals[k], errors)).map(|errors| (errors.rms(), k)))
            .collect();
        better.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, k) in better {
            if let Some((state, errors)) = fitted(Some(k)).filter(|(_, errors)| convinces(&rivals[k], errors)) {
                let gain = errors.gain_over(&bare);
                return Outcome::Exchanged { state, errors, with: rivals[k].at, gain };
            }
        }
        if useless(&bare)
            && let Some((state, errors)) = fitted(None).filter(|(_, errors)| useless(errors))
        {
            return Outcome::Dropped(state, errors);
        }
        Outcome::Stands(seen.gain_over(&bare))
    }
}
