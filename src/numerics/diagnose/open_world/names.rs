//! The odds that a finding is none of the list: evidence of its name and of its rivals against that of free forms instead of it and beside it.

use super::evidence::{evidence, log_sum};
use super::free_form::{AroundGroups, FreeForm, PlaceGroups};
use super::groups::places;
use super::state::KnownCauses;
use crate::criteria::open_world::{CLEARLY, FINER, MIMICRY, MISLED, NOTHING, PLACES, RIVALS};
use crate::diagnose::finding_groups::FindingKey;
use crate::diagnose::judge::JudgedCauses;
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{EstimatedCause, FitState};
use crate::effect::{Place, names};
use nalgebra::DMatrix;
use rayon::prelude::*;

/// What is said against a finding's name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NameOdds {
    /// That it is none of the list, by evidence and priors.
    pub none: f64,
    /// That it acts at its place, whatever it is.
    pub place: f64,
    /// ln of the evidence of the finding beside all others, without a price.
    pub log: f64,
    /// What it holds of all that the best free form beside it explains with it.
    pub share: f64,
}

/// A finding's odds, and what would stand in its place.
pub(super) struct ContestedName {
    pub members: Vec<usize>,
    pub odds: NameOdds,
    /// The best free form instead of it, where it says more than the finding with a free form beside it.
    pub instead: Option<FreeForm>,
    /// A law of the list that says more than what has no name, by its number among the hypotheses.
    pub named: Option<usize>,
    /// What the finding's own name has of the evidence of all names.
    pub share_of_names: f64,
}

/// What the free forms of all places say beside a state.
pub(super) struct SurveyedPlaces {
    /// ln of the evidence of each place's.
    pub logs: Vec<(Place, f64)>,
    /// The same of one group alone.
    pub firsts: Vec<(Place, f64)>,
    /// The best ones with their terms, best first.
    pub best: Vec<FreeForm>,
}

/// The groups of all places, without their columns.
pub(super) fn groups_of_places(around: &AroundGroups) -> Vec<PlaceGroups> {
    places(around.survey).par_iter().map(|place| PlaceGroups::of(*place, around, false)).collect()
}

/// Free forms of all places, whose groups are `all`, beside some states: of each state the evidence by place, and the best ones with their
/// terms.
pub(super) fn survey_places(
    states: &[(KnownCauses, Option<Place>)],
    all: &[PlaceGroups],
    around: &AroundGroups,
) -> Vec<SurveyedPlaces> {
    let beside: Vec<&KnownCauses> = states.iter().map(|(state, _)| state).collect();
    let first = |groups: &PlaceGroups| -> Vec<f64> {
        let groups = groups.with_pairs(&beside, around, false);
        beside.iter().map(|state| groups.first(state)).collect()
    };
    let firsts: Vec<Vec<f64>> = all.par_iter().map(first).collect();
    let all: Vec<Place> = all.iter().map(|groups| groups.place).collect();
    let mut wanted: Vec<(usize, usize)> = Vec::new();
    for (s, (_, own)) in states.iter().enumerate() {
        let mut order: Vec<usize> = (0..all.len()).collect();
        order.sort_by(|a, b| firsts[*b][s].total_cmp(&firsts[*a][s]));
        let mut chosen: Vec<usize> = order.into_iter().take(*PLACES).filter(|p| firsts[*p][s] > 0.0).collect();
        chosen.extend((0..all.len()).filter(|p| Some(all[*p]) == *own && !chosen.contains(p)).collect::<Vec<_>>());
        wanted.extend(chosen.into_iter().map(|p| (p, s)));
    }
    let by_place: Vec<usize> = (0..all.len()).filter(|p| wanted.iter().any(|(other, _)| other == p)).collect();
    let forms: Vec<Vec<(usize, FreeForm)>> = by_place
        .par_iter()
        .map(|p| {
            let (groups, own) = (PlaceGroups::of(all[*p], around, true), wanted.iter().filter(|(other, _)| other == p));
            own.map(|(_, s)| (*s, groups.with_pairs(&[&states[*s].0], around, true).greedy(&states[*s].0, around))).collect()
        })
        .collect();
    let forms: Vec<(usize, FreeForm)> = forms.into_iter().flatten().collect();
    (0..states.len())
        .map(|s| {
            let mut own: Vec<FreeForm> = forms.iter().filter(|(of, _)| *of == s).map(|(_, form)| form.clone()).collect();
            own.sort_by(|a, b| b.log.total_cmp(&a.log));
            let log = |p: usize| own.iter().find(|form| form.place == all[p]).map_or(firsts[p][s], |form| form.log);
            let logs = (0..all.len()).map(|p| (all[p], log(p))).collect();
            let firsts = (0..all.len()).map(|p| (all[p], firsts[p][s])).collect();
            SurveyedPlaces { logs, firsts, best: own }
        })
        .collect()
}

/// A finding's part of the model.
pub(super) struct NamedFinding {
    pub key: FindingKey,
    pub members: Vec<usize>,
    /// Columns of the model's causes that are its own, with the prior variances of their coefficients at 1 m.
    pub own: Vec<(usize, f64)>,
}

/// What the judgement of a finding rests on.
pub(super) struct NameCase<'c, 'f, 'a, 'p> {
    pub around: &'c AroundGroups<'f, 'a>,
    pub pool: &'c CachedHypotheses<'p>,
    pub judged: &'c JudgedCauses,
    /// Prior probability of a cause that is in no list.
    pub open_world: f64,
}

impl NameCase<'_, '_, '_, '_> {
    /// `rest` is the state without the finding, `instead` the free forms beside it; `beside` are those beside everything.
    pub fn odds(
        &self,
        named: &NamedFinding,
        rest: &KnownCauses,
        instead: &SurveyedPlaces,
        beside: &SurveyedPlaces,
    ) -> ContestedName {
        let (effect, place) = named.key;
        let set = &self.judged.set;
        let own = self.evidence_of_causes(rest, &named.own);
        let price = |members: &[usize]| -> f64 { members.iter().map(|i| self.price(set[*i])).sum() };
        let [open, listed] = self.priors(instead.logs.len());
        let is_named = effect != names::UNKNOWN && self.around.without.iter().all(|name| name != effect);
        let mine = listed + own.log - price(&named.members);
        let best_beside = beside.best.first();
        let more = |form: &FreeForm| form.gain / (form.gain + own.gain).max(f64::MIN_POSITIVE);
        let refined = beside.best.iter().find(|form| form.place == place && more(form) < *FINER && form.log > 0.0);
        let mut names: Vec<(Place, f64)> = Vec::new();
        if is_named {
            names.push((place, mine));
            names.extend(refined.map(|form| (place, mine + form.log + 0.5f64.ln())));
        }
        let rivals = self.listed(&named.members, rest);
        names.extend(rivals.iter().filter(|rival| rival.key != named.key).map(|rival| (rival.key.1, rival.log + listed)));
        let mut free: Vec<(Place, f64)> = instead.logs.iter().map(|(place, log)| (*place, open + log)).collect();
        if !is_named {
            free.push((place, open + own.log - price(&named.members)));
        } else if let Some(form) = best_beside.filter(|form| form.log > 0.0 && more(form) >= *FINER) {
            free.push((place, open + mine + form.log));
        }
        let logs = |of: &[(Place, f64)]| log_sum(&of.iter().map(|(_, log)| *log).collect::<Vec<_>>());
        let here =
            |of: &[(Place, f64)]| log_sum(&of.iter().filter(|(at, _)| *at == place).map(|(_, log)| *log).collect::<Vec<_>>());
        let all = log_sum(&[logs(&names), logs(&free), NOTHING.ln()]);
        let odds = NameOdds {
            none: (logs(&free) - all).exp().clamp(self.least(*MIMICRY), 1.0 - *MISLED),
            place: (log_sum(&[here(&names), here(&free)]) - all).exp(),
            log: own.log,
            share: best_beside.map_or(1.0, |form| 1.0 - more(form)),
        };
        let alternative = instead.best.first().filter(|form| !form.terms.is_empty());
        let with_more = own.log + best_beside.map_or(0.0, |form| form.log.max(0.0));
        // What has no name may act somewhere else: it was the best of its round, beside less than is known now.
        let may_go = |form: &&FreeForm| if is_named { odds.none > 0.5 } else { form.place != place };
        let instead = alternative.filter(may_go).filter(|form| form.log > with_more + *CLEARLY).cloned();
        let best = rivals.iter().max_by(|a, b| a.log.total_cmp(&b.log));
        let nameless = named.members.iter().all(|i| self.judged.state.causes[*i].form.cause().is_nameless());
        let better = |rival: &&LawOfTheList| nameless && !is_named && odds.none < 0.5 && rival.log + listed > open + own.log;
        ContestedName {
            members: named.members.clone(),
            odds,
            instead,
            named: best.filter(better).map(|rival| rival.at),
            share_of_names: (mine - logs(&names)).exp(),
        }
    }

    /// The least probability that it is none of the list: what the list lacks looks like a law of it at times, and no evidence tells.
    pub fn least(&self, mimicry: f64) -> f64 {
        let mimicry = self.open_world * mimicry;
        (mimicry / (mimicry + 1.0 - self.open_world)).clamp(*MISLED, 1.0 - *MISLED)
    }

    /// Evidence and fall of the squared residual of some columns of the model's causes beside a state.
    fn evidence_of_causes(&self, rest: &KnownCauses, own: &[(usize, f64)]) -> Own {
        let columns = own.iter().map(|(k, _)| *k).collect::<Vec<_>>();
        let picked = self.around.causes.columns.select_columns(&columns);
        let variances: Vec<f64> = own.iter().map(|(_, variance)| *variance).collect();
        self.evidence_of(rest, &picked, &variances)
    }

    /// ln of a hypothesis' prior odds, negative; of what is called by a name only when it is fitted those of its kind and place.
    pub fn price(&self, h: usize) -> f64 {
        let hypothesis = &self.pool.hypotheses[h];
        if hypothesis.form.cause().is_nameless() {
            return hypothesis.tried.ln() + (hypothesis.form.place().count(self.around.survey.joints()) as f64).ln();
        }
        0.5 * self.pool.prior_penalty[h]
    }

    /// ln of the prior odds of a free form at a place, and of a law of the list by its price, over each other's share.
    pub fn priors(&self, places: usize) -> [f64; 2] {
        [self.open_world.ln() - (places.max(1) as f64).ln(), (1.0 - self.open_world).ln() - self.all_prices()]
    }

    /// ln of the sum of the prior odds of all laws of the list.
    fn all_prices(&self) -> f64 {
        let named = (0..self.pool.hypotheses.len()).filter(|h| !self.pool.hypotheses[*h].form.cause().is_nameless());
        log_sum(&named.map(|h| -self.price(h)).collect::<Vec<_>>())
    }

    /// Evidence and fall of the squared residual of columns beside a state.
    fn evidence_of(&self, rest: &KnownCauses, columns: &DMatrix<f64>, variances: &[f64]) -> Own {
        let with = |square: f64| {
            let scaled: Vec<f64> = variances.iter().map(|variance| variance * square).collect();
            rest.with(self.around.frame, columns, &scaled).gain() - rest.gain()
        };
        let products = rest.of_columns(self.around.frame, columns);
        let found = evidence(&products.gram, &products.gradient, variances);
        Own { log: found.log, gain: with(found.amplitude * found.amplitude) }
    }

    /// Laws of the list beside all causes but some, the best of each name and place, with their prices.
    pub fn listed(&self, without: &[usize], rest: &KnownCauses) -> Vec<LawOfTheList> {
        let mut others: Vec<usize> =
            (0..self.judged.set.len()).filter(|i| !without.contains(i)).map(|i| self.judged.set[i]).collect();
        others.sort_unstable();
        let given = self.pool.given(&others);
        let mut tried: Vec<FindingKey> = Vec::new();
        let mut out = Vec::new();
        for (_, h) in &given.falls {
            let form = &self.pool.hypotheses[*h].form;
            let key = (form.name(), form.place());
            if form.cause().is_nameless() || self.pool.of_torque_model[*h] || tried.contains(&key) {
                continue;
            }
            tried.push(key);
            let block = self.around.frame.block(form);
            let size: f64 = block.square.iter().sum();
            let variances = vec![1.0 / size.max(f64::MIN_POSITIVE); block.square.len()];
            let products = rest.of_columns(self.around.frame, &block.columns);
            let found = evidence(&products.gram, &products.gradient, &variances);
            out.push(LawOfTheList { key, at: *h, log: found.log - self.price(*h) });
            if out.len() == *RIVALS {
                break;
            }
        }
        out
    }
}

/// A law of the list in the place of something.
pub(super) struct LawOfTheList {
    pub key: FindingKey,
    /// Its number among the hypotheses.
    pub at: usize,
    /// ln of its evidence with its price among the laws of the list.
    pub log: f64,
}

struct Own {
    log: f64,
    gain: f64,
}

/// Roots of the prior variances of a cause's coefficients as they are in the model: of a free form its own, of a law those of its size.
pub(super) fn fitted_variances(state: &FitState, cause: usize, square: &[f64]) -> Vec<f64> {
    let own = &state.causes[cause];
    if own.form.cause().is_nameless() && own.priors.len() == square.len() {
        return own.priors.iter().map(|prior| prior.sigma * prior.sigma).collect();
    }
    let x = &state.model.x[state.ranges[cause].clone()];
    let all: f64 = square.iter().sum();
    let size: f64 = x.iter().zip(square).map(|(x, square)| x * x * square).sum();
    square.iter().map(|_| size.max(1e-12) / all.max(f64::MIN_POSITIVE)).collect()
}

/// Prior variances of a cause's coefficients of unit mean square at the tool: of a free form as its spectrum has them, of a law all alike.
pub(super) fn unit_variances(cause: &EstimatedCause, square: &[f64]) -> Vec<f64> {
    let own = cause.form.cause().is_nameless() && cause.priors.len() == square.len();
    let shape: Vec<f64> =
        if own { cause.priors.iter().map(|prior| prior.sigma * prior.sigma).collect() } else { vec![1.0; square.len()] };
    let all: f64 = shape.iter().zip(square).map(|(variance, square)| variance * square).sum();
    shape.into_iter().map(|variance| variance / all.max(f64::MIN_POSITIVE)).collect()
}
