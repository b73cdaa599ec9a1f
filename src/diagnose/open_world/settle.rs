//! What free forms add to a judged model, or put in the place of its names, as far as folds agree; and the odds of what stands.

use super::frame::{Block, Frame};
use super::free_form::{FreeForm, FreeTerm, Surroundings, side_by_side};
use super::names::{Case, Contested, NameOdds, Named, fitted_variances, survey_places};
use super::state::State;
use crate::diagnose::judge::{FoldErrors, JudgedCauses};
use crate::diagnose::pool::CachedHypotheses;
use crate::diagnose::round::{EstimatedCause, FitState, Fitter, RoundView};
use crate::diagnose::words::{FindingKey, groups};
use crate::effect::{Effect, Hypothesis, Place, Survey};
use crate::estimate::Prior;
use std::collections::BTreeMap;

/// Free forms that join a model at most.
const ROUNDS: usize = 4;
/// ln of the evidence of a free form beside everything, over the number of places, above which it joins.
const STRONG: f64 = 3.0;
/// What goes may cost this share of the folds' rms.
const WORSE: f64 = 0.01;
/// A noise that is larger than stated by less than this share, in squares, is the stated one.
const LOUDER: f64 = 1.05;

/// A judged model with free forms, and the odds of its findings.
pub(crate) struct Settled {
    pub judged: JudgedCauses,
    pub odds: BTreeMap<FindingKey, NameOdds>,
}

/// What a look at a model says.
struct Look {
    odds: BTreeMap<FindingKey, Contested>,
    beside: Vec<FreeForm>,
    places: usize,
    /// The law of the list that says more beside everything than the best free form, by its number among the hypotheses.
    named: Option<usize>,
}

/// Asks free forms beside a judged model and instead of its findings. `view` and `survey` are those of the round before.
pub(crate) fn settle(
    mut judged: JudgedCauses,
    pool: &mut CachedHypotheses,
    survey: &Survey,
    fitter: &Fitter,
    tell: &mut dyn FnMut(String),
) -> Settled {
    if std::env::var_os("CALIB_CLOSED").is_some() {
        return Settled { judged, odds: BTreeMap::new() };
    }
    let mut refused: Vec<Place> = Vec::new();
    for _ in 0..ROUNDS {
        let look = look(&judged, pool, survey, fitter);
        let price = (look.places.max(1) as f64).ln();
        let strong = look.beside.iter().find(|form| form.log - price > STRONG && !refused.contains(&form.place));
        let joined = strong.and_then(|form| {
            let next = with_free_form(&judged, &[], &form.terms, pool, fitter, 0.0);
            if next.is_none() {
                refused.push(form.place);
            }
            next.map(|next| (next, format!("a free form at {} joins: {:.0} nats of evidence", form.place, form.log)))
        });
        let law = |h: usize| pool.hypotheses[h].clone();
        let named = strong.and_then(|_| {
            let law = law(look.named?);
            let sentence = format!("{} at {} joins: it says more than a free form", law.form.name(), law.form.place());
            Some((with_law(&judged, &[], law, pool, fitter)?, sentence))
        });
        let christened = || {
            look.odds.values().find_map(|contested| {
                let law = law(contested.named?);
                let sentence = format!("{} at {} says more than a law without a name", law.form.name(), law.form.place());
                Some((with_law(&judged, &contested.members, law, pool, fitter)?, sentence))
            })
        };
        let exchanged = || {
            look.odds.values().find_map(|contested| {
                let form = contested.instead.as_ref()?;
                let next = with_free_form(&judged, &contested.members, &form.terms, pool, fitter, 0.0)?;
                Some((next, format!("a free form at {} says more than a finding", form.place)))
            })
        };
        let dropped = || {
            look.odds.iter().find_map(|((effect, place), contested)| {
                let nothing = contested.odds.log < 0.0;
                let next = nothing.then(|| with_free_form(&judged, &contested.members, &[], pool, fitter, WORSE))??;
                Some((next, format!("{effect} at {place} is withdrawn: nothing is left for it beside the others")))
            })
        };
        let Some((next, sentence)) = named.or(joined).or_else(christened).or_else(exchanged).or_else(dropped) else {
            return Settled { judged, odds: look.odds.into_iter().map(|(key, own)| (key, own.odds)).collect() };
        };
        tell(sentence);
        let Next { state, kept, new } = next;
        let mut set: Vec<usize> = kept.iter().map(|i| judged.set[*i]).collect();
        let first = pool.add(new);
        set.extend(first..pool.hypotheses.len());
        judged = JudgedCauses { state, set, gains: Vec::new(), withdrawn: judged.withdrawn };
    }
    let last = look(&judged, pool, survey, fitter);
    Settled { judged, odds: last.odds.into_iter().map(|(key, own)| (key, own.odds)).collect() }
}

/// A model with another free form.
struct Next {
    state: FitState,
    /// Causes that stay, by their positions.
    kept: Vec<usize>,
    new: Vec<Hypothesis>,
}

/// The model without some causes and with a law of the list, where folds are no worse.
fn with_law(
    judged: &JudgedCauses,
    without: &[usize],
    law: Hypothesis,
    pool: &CachedHypotheses,
    fitter: &Fitter,
) -> Option<Next> {
    let zeros = vec![0.0; law.form.parameters(pool.problem.robot).len()];
    let cause = EstimatedCause::shrunk(law.form.clone(), pool.problem.robot, zeros);
    exchanged(judged, without, vec![law], vec![cause], pool, fitter, 0.0)
}

/// The model without some causes and with a free form, where folds are no worse by more than a share of their rms.
fn with_free_form(
    judged: &JudgedCauses,
    without: &[usize],
    terms: &[FreeTerm],
    pool: &CachedHypotheses,
    fitter: &Fitter,
    worse: f64,
) -> Option<Next> {
    let new: Vec<Hypothesis> = terms.iter().map(|term| term.group.hypothesis()).collect();
    let free = new.iter().zip(terms).map(|(hypothesis, term)| EstimatedCause {
        form: hypothesis.form.clone(),
        coefficients: vec![0.0; term.variances.len()],
        priors: term.variances.iter().map(|variance| Prior { mean: 0.0, sigma: variance.sqrt() }).collect(),
    });
    let free = free.collect();
    exchanged(judged, without, new, free, pool, fitter, worse)
}

/// The model without some causes and with others, where folds are no worse by more than a share of their rms.
fn exchanged(
    judged: &JudgedCauses,
    without: &[usize],
    new: Vec<Hypothesis>,
    causes: Vec<EstimatedCause>,
    pool: &CachedHypotheses,
    fitter: &Fitter,
    worse: f64,
) -> Option<Next> {
    let keys: Vec<String> = new.iter().map(|hypothesis| hypothesis.form.key()).collect();
    let stays = |i: &usize| !without.contains(i) && !keys.contains(&pool.keys[judged.set[*i]]);
    let kept: Vec<usize> = (0..judged.set.len()).filter(stays).collect();
    let causes: Vec<EstimatedCause> = kept.iter().map(|i| judged.state.causes[*i].clone()).chain(causes).collect();
    let state = fitter.fit(&judged.state.model, causes);
    let (before, after) = (FoldErrors::of(&judged.state, fitter)?, FoldErrors::of(&state, fitter)?);
    (after.gain_over(&before) > -worse * before.rms()).then_some(Next { state, kept, new })
}

/// The odds of all findings, and the free forms beside them all.
fn look(judged: &JudgedCauses, pool: &CachedHypotheses, survey: &Survey, fitter: &Fitter) -> Look {
    let data = fitter.without_inferred_noise();
    let view = RoundView::on(&data, &judged.state, fitter);
    let frame = Frame::of(&view, &judged.state, fitter);
    let blocks: Vec<Block> = judged.state.causes.iter().map(|cause| frame.block(&cause.form)).collect();
    let all = side_by_side(&blocks, frame.residual_rows());
    let around = Surroundings { frame: &frame, survey, causes: all.as_ref(), without: fitter.question.without };
    let mut first = Vec::with_capacity(blocks.len());
    let mut at = 0;
    for block in &blocks {
        first.push(at);
        at += block.square.len();
    }
    let columns = |i: usize| first[i]..first[i] + blocks[i].square.len();
    let picked = |members: &dyn Fn(usize) -> bool| -> Vec<(usize, f64)> {
        let of = |i: usize| columns(i).zip(fitted_variances(&judged.state, i, &blocks[i].square));
        (0..blocks.len()).filter(|i| members(*i)).flat_map(of).map(|(k, variance)| (k, variance.sqrt())).collect()
    };
    let mut scale = 1.0 / view.autocorrelation_time();
    let whole = |scale: f64| State::of(&frame, all.as_ref(), picked(&|_| true), scale);
    let mut beside = survey_places(&[(whole(scale), None)], &around).remove(0);
    let louder = louder(&frame, &whole(scale), beside.1.first(), scale, fitter);
    if louder > LOUDER {
        scale /= louder;
        beside = survey_places(&[(whole(scale), None)], &around).remove(0);
    }
    let findings = groups(&judged.state, &judged.set, pool, survey);
    let named: Vec<Named> = findings
        .iter()
        .map(|(key, members)| {
            let size = |i: usize| 1.0 / (members.len() as f64 * blocks[i].square.iter().sum::<f64>()).max(f64::MIN_POSITIVE);
            let own = members.iter().flat_map(|i| columns(*i).map(|k| (k, size(*i)))).collect();
            Named { key: *key, members, own }
        })
        .collect();
    let rests: Vec<(State, Option<Place>)> = named
        .iter()
        .map(|own| {
            let rest = picked(&|i| !own.members.contains(&i));
            (State::of(&frame, all.as_ref(), rest, scale), Some(own.key.1))
        })
        .collect();
    let instead = survey_places(&rests, &around);
    let case = Case { around: &around, pool, judged };
    let odds = named.iter().zip(&rests).zip(&instead);
    let odds = odds.map(|((own, (rest, _)), instead)| (own.key, case.odds(own, rest, instead, &beside))).collect();
    if std::env::var_os("CALIB_DEBUG").is_some() {
        eprintln!("LOOK louder {louder:.2} beside {:?}", beside.1.iter().map(|f| (f.place.to_string(), f.log, f.gain, f.terms.iter().map(|t| format!("{:?}", (t.group.motion, t.group.law.variables()))).collect::<Vec<_>>())).collect::<Vec<_>>());
        let odds: &BTreeMap<FindingKey, Contested> = &odds;
        for ((key, own), (instead, rest)) in odds.iter().zip(instead.iter().zip(&rests)) {
            let _ = rest;
            eprintln!("  {} at {}: log {:.1} none {:.3} place {:.3} share {:.2}; instead {:?} exchange {:?}", key.0, key.1, own.odds.log, own.odds.none, own.odds.place, own.odds.share, instead.1.iter().map(|f| (f.place.to_string(), f.log, f.terms.iter().map(|t| format!("{:?}", (t.group.motion, t.group.law.variables()))).collect::<Vec<_>>())).collect::<Vec<_>>(), own.instead.is_some());
        }
    }
    let best = beside.1.first().map(|form| form.log);
    let named = best.and_then(|log| {
        let [open, listed] = case.priors(beside.0.len());
        let laws = case.listed(&[], &whole(scale));
        let best = laws.into_iter().max_by(|a, b| a.log.total_cmp(&b.log))?;
        (best.log + listed > log + open).then_some(best.at)
    });
    Look { odds, places: beside.0.len(), named, beside: beside.1 }
}

/// By how much the noise is larger, in squares, than what repeats and statements say: what the richest model leaves, repeats weighing in.
fn louder(frame: &Frame, whole: &State, richest: Option<&FreeForm>, scale: f64, fitter: &Fitter) -> f64 {
    let left = frame.square() * scale - whole.gain() - richest.map_or(0.0, |form| form.gain);
    let repeats = 3.0 * fitter.repeatability.repeats as f64;
    let freedom = (frame.residual_rows().saturating_sub(frame.rank())) as f64 * scale;
    (repeats + left.max(0.0)) / (repeats + freedom).max(1.0)
}
