//! Add, exchange, drop, until nothing changes; then leave each out once.

use crate::{Accepted, Cell, Finding, Problem, Rival, Scanned};
use calib_diagnose::table::log_sum;
use rayon::prelude::*;

/// Numbers that decide.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// ln of the odds above which a cell joins (Jeffreys, 1961: strong).
    pub joins: f64,
    /// ln of the odds below which one leaves.
    pub leaves: f64,
    /// ln by which an exchange must be better.
    pub exchanges: f64,
    /// Cells that are fitted in a round: a linear scan ranks, only a fit decides.
    pub tried: usize,
    /// Cells in all; more is a model of nothing.
    pub most: usize,
    /// Rivals less probable are not told.
    pub told: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            joins: 3.0,
            leaves: 2.0,
            exchanges: 0.5,
            tried: 8,
            most: 12,
            told: 5e-3,
        }
    }
}

/// What a search ends with.
#[derive(Debug, Clone)]
pub struct Answer<P: Problem> {
    /// The model without any cell.
    pub before: P::Fit,
    /// The model with all that stand.
    pub after: P::Fit,
    /// What stands, strongest first.
    pub findings: Vec<Finding<P::Key>>,
}

/// Exchanges at most: each is for the better, so none comes twice.
const EXCHANGES: usize = 6;

/// A fit of a trial with the evidence that decides.
struct Trial<P: Problem> {
    fit: P::Fit,
    log: f64,
    cell: Cell<P::Key>,
}

/// Cells of a scan that a set allows, the first of each name and place, as many as are tried.
fn candidates<P: Problem>(
    problem: &P,
    scanned: Vec<Scanned<P::Key>>,
    set: &[Accepted<P::Key>],
    options: &Options,
) -> Vec<Scanned<P::Key>> {
    let free = |one: &Scanned<P::Key>| {
        let key = &one.accepted.cell.key;
        set.iter()
            .all(|other| !problem.excludes(key, &other.cell.key))
    };
    let mut kept: Vec<Scanned<P::Key>> = Vec::new();
    for one in scanned.into_iter().filter(free) {
        let cell = &one.accepted.cell;
        let is_same = |other: &&Scanned<P::Key>| {
            let other = &other.accepted.cell;
            other.cause.name == cell.cause.name && other.place == cell.place
        };
        if one.log_odds > options.joins && kept.iter().find(is_same).is_none() {
            kept.push(one);
        }
        if kept.len() == options.tried {
            break;
        }
    }
    kept
}

/// Fits of a set with each of some cells beside it, best first.
fn trials<P: Problem>(
    problem: &P,
    fit: &P::Fit,
    candidates: Vec<Scanned<P::Key>>,
    independence: f64,
) -> Vec<Trial<P>> {
    let set = problem.set(fit);
    let mut trials: Vec<Trial<P>> = candidates
        .into_par_iter()
        .map(|one| {
            let cell = one.accepted.cell.clone();
            let mut with = set.clone();
            with.push(one.accepted);
            let fit = problem.fit(&with, Some(fit));
            let log = problem.log_evidence(&fit, independence);
            Trial { fit, log, cell }
        })
        .collect();
    trials.sort_by(|a, b| b.log.total_cmp(&a.log));
    trials
}

/// The likeliest set from a fit on: a pure function of the problem and its start.
pub fn search<P: Problem>(
    problem: &P,
    start: &P::Fit,
    options: &Options,
    mut tell: impl FnMut(String),
) -> P::Fit {
    let mut fit = start.clone();
    while problem.set(&fit).len() < options.most {
        // A scan may tell how many rows count.
        let scanned = problem.scan(&fit);
        let independence = problem.independence(&fit);
        let now = problem.log_evidence(&fit, independence);
        let set = problem.set(&fit);
        let asked = candidates(problem, scanned, &set, options);
        let tried = trials(problem, &fit, asked, independence);
        for trial in tried.iter().take(4) {
            let (name, place) = (trial.cell.cause.name, &trial.cell.place);
            tell(format!(
                "  {name} at {place}: ln odds {:.1}",
                trial.log - now
            ));
        }
        let Some(best) = tried.into_iter().next() else {
            break;
        };
        if best.log - now < options.joins {
            break;
        }
        tell(format!(
            "{} at {} joins",
            best.cell.cause.name, best.cell.place
        ));
        fit = problem.settled(&best.fit);
        fit = revised(problem, fit, options, &mut tell);
    }
    fit
}

/// Earlier members are dropped or exchanged where the later ones made them so.
fn revised<P: Problem>(
    problem: &P,
    mut fit: P::Fit,
    options: &Options,
    tell: &mut impl FnMut(String),
) -> P::Fit {
    let mut at = 0;
    while problem.set(&fit).len() > 1 && at + 1 < problem.set(&fit).len() {
        let independence = problem.independence(&fit);
        let now = problem.log_evidence(&fit, independence);
        let mut rest = problem.set(&fit);
        let out = rest.remove(at);
        let without = problem.fit(&rest, Some(&fit));
        let log = problem.log_evidence(&without, independence);
        if now - log < options.leaves {
            tell(format!(
                "{} at {} leaves",
                out.cell.cause.name, out.cell.place
            ));
            fit = problem.settled(&without);
            continue;
        }
        at += 1;
    }
    fit
}

/// What stands, each with what else could stand in its place.
pub fn posterior<P: Problem>(problem: &P, fit: &P::Fit, options: &Options) -> Vec<Finding<P::Key>> {
    let set = problem.set(fit);
    let independence = problem.independence(fit);
    let now = problem.log_evidence(fit, independence);
    let mut findings: Vec<Finding<P::Key>> = set
        .iter()
        .enumerate()
        .map(|(at, accepted)| {
            let mut rest = set.clone();
            rest.remove(at);
            let without = problem.fit(&rest, Some(fit));
            let none = problem.log_evidence(&without, independence);
            let asked = candidates(problem, problem.scan(&without), &rest, options);
            let own = &accepted.cell;
            let asked = asked
                .into_iter()
                .filter(|one| {
                    let cell = &one.accepted.cell;
                    cell.cause.name != own.cause.name || cell.place != own.place
                })
                .collect();
            let others = trials(problem, &without, asked, independence);
            let logs: Vec<f64> = [now, none]
                .into_iter()
                .chain(others.iter().map(|trial| trial.log))
                .collect();
            let whole = log_sum(&logs);
            let share = |log: f64| (log - whole).exp();
            let here: f64 = others
                .iter()
                .filter(|trial| trial.cell.place == own.place)
                .map(|trial| share(trial.log))
                .sum();
            let rivals = others
                .iter()
                .map(|trial| Rival {
                    accepted: problem
                        .set(&trial.fit)
                        .pop()
                        .unwrap_or_else(|| accepted.clone()),
                    probability: share(trial.log),
                    log_odds: trial.log - now,
                })
                .filter(|rival| rival.probability >= options.told)
                .collect();
            Finding {
                accepted: accepted.clone(),
                probability: share(now),
                place_probability: (share(now) + here).min(1.0),
                none_probability: share(none),
                log_odds: now - none,
                rivals,
            }
        })
        .collect();
    findings.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    findings
}

/// Searches until nothing changes, and says what stands.
pub fn diagnose<P: Problem>(
    problem: &P,
    options: &Options,
    mut tell: impl FnMut(String),
) -> Answer<P> {
    let before = problem.fit(&[], None);
    let mut after = search(problem, &before, options, &mut tell);
    let mut findings = posterior(problem, &after, options);
    for _ in 0..EXCHANGES {
        let better = findings.iter().find_map(|finding| {
            let rival = finding.rivals.first()?;
            (rival.log_odds > options.exchanges)
                .then(|| (finding.accepted.clone(), rival.accepted.clone()))
        });
        let Some((out, into)) = better else {
            break;
        };
        tell(format!(
            "{} at {} in place of {} at {}",
            into.cell.cause.name, into.cell.place, out.cell.cause.name, out.cell.place
        ));
        let mut set = problem.set(&after);
        set.retain(|one| one.cell != out.cell);
        set.push(into);
        let exchanged = problem.settled(&problem.fit(&set, Some(&after)));
        after = search(problem, &exchanged, options, &mut tell);
        findings = posterior(problem, &after, options);
    }
    Answer {
        before,
        after,
        findings,
    }
}
