//! Add, exchange, drop, until nothing changes; then leave each out once.

use crate::{Accepted, Cell, Finding, Problem, Rival, Scanned, log_sum};
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
    /// Cells of one name and place among them: forms of a cause that a linear scan hardly tells apart.
    pub forms: usize,
    /// Trials that come near the best are fitted to the end, so many in all, before one joins.
    pub last: usize,
    /// Exchanges at most: each is for the better, so none comes twice.
    pub exchanged: usize,
    /// Whether one cell may replace all members of a place at once: where causes are fitted with numbers of their own, several can imitate one.
    pub regroups: bool,
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
            exchanged: 8,
            tried: 8,
            forms: 1,
            last: 1,
            regroups: true,
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
    /// Whether its fits are accurate enough for what was found; there are no findings where they are not.
    pub is_accurate: bool,
}

/// Members of a place that one may replace at once: for a single one that is an exchange.
const SEVERAL: usize = 2;
/// ln by which a linear scan may be wrong, and the share of it: what is further behind is not fitted.
const BLUR: f64 = 20.0;
const BLUR_SHARE: f64 = 0.5;

/// Share of the gain by which a trial may be behind that is fitted to the end before one joins.
const NEAR: f64 = 0.3;

/// Cells that may join in a search, of those that may stand.
const ROUNDS: usize = 2;

/// A model, and what is seen around it.
struct Stand<P: Problem> {
    fit: P::Fit,
    around: P::Around,
    /// Whether the fit is accurate enough; where it is not, the linearisation is that of an earlier one.
    is_accurate: bool,
}

impl<P: Problem> Stand<P> {
    fn new(problem: &P, fit: P::Fit, before: Option<&P::Around>) -> Self {
        let around = problem.around(&fit, before);
        let fit = problem.informed(fit, &around);
        Self {
            fit,
            around,
            is_accurate: true,
        }
    }
}

/// A fit of a trial with the evidence that decides.
struct Trial<P: Problem> {
    fit: P::Fit,
    log: f64,
    cell: Cell<P::Key>,
}

/// Whether every cell of a set has those that it needs.
fn is_whole<K: PartialEq>(set: &[Accepted<K>]) -> bool {
    let has = |key: &K| set.iter().any(|one| one.cell.key == *key);
    set.iter().all(|one| one.cell.needs.iter().all(has))
}

/// A set without a member.
fn without<K: Clone>(set: &[Accepted<K>], member: usize) -> Vec<Accepted<K>> {
    [&set[..member], &set[member + 1..]].concat()
}

/// Cells of a scan that a set allows, the first ones of each name and place, as many as are tried; `least` is the linear evidence below which
/// none is.
fn candidates<P: Problem>(
    problem: &P,
    scanned: Vec<Scanned<P::Key>>,
    set: &[Accepted<P::Key>],
    least: f64,
    options: &Options,
) -> Vec<Scanned<P::Key>> {
    let free = |one: &Scanned<P::Key>| {
        let new = &one.accepted;
        let whole = [set, std::slice::from_ref(new)].concat();
        let apart = |other| !problem.excludes(new, other);
        set.iter().all(apart) && is_whole(&whole)
    };
    let mut kept: Vec<Scanned<P::Key>> = Vec::new();
    for one in scanned.into_iter().filter(free) {
        let is_same = |other: &&Scanned<P::Key>| problem.is_same(&other.accepted, &one.accepted);
        if one.log_odds > least.max(options.joins)
            && kept.iter().filter(is_same).count() < options.forms
        {
            kept.push(one);
        }
        if kept.len() == options.tried {
            break;
        }
    }
    kept
}

/// Fits of a set with each of some cells added, best first, of those that are still in their fit, and the share of independent rows at which
/// they are compared. A fit may stop early where its evidence cannot reach `least`, or what `near` makes of the evidence of the likeliest.
fn trials<P: Problem>(
    problem: &P,
    fit: &P::Fit,
    set: &[Accepted<P::Key>],
    candidates: Vec<Scanned<P::Key>>,
    least: f64,
    near: impl Fn(f64) -> f64,
) -> (Vec<Trial<P>>, f64) {
    let independence = problem.independence(fit);
    let tried = |one: Scanned<P::Key>, least: f64| {
        let cell = one.accepted.cell.clone();
        let mut with = set.to_vec();
        with.push(one.accepted);
        let fit = problem.fit(&with, Some(fit), least);
        let log = problem.log_evidence(&fit, independence);
        Trial { fit, log, cell }
    };
    let mut candidates = candidates.into_iter();
    let Some(likeliest) = candidates.next() else {
        return (Vec::new(), independence);
    };
    let first = tried(likeliest, least);
    let least = least.max(near(first.log));
    let rest: Vec<Scanned<P::Key>> = candidates.collect();
    let rest = rest.into_par_iter().map(|one| tried(one, least));
    let mut trials: Vec<Trial<P>> = rest.collect();
    trials.push(first);
    let stands = |trial: &Trial<P>| standing(problem, trial).is_some();
    trials.retain(stands);
    let independence = compared_at(problem, fit, &trials);
    for trial in &mut trials {
        trial.log = problem.log_evidence(&trial.fit, independence);
    }
    trials.sort_by(|a, b| b.log.total_cmp(&a.log));
    (trials, independence)
}

/// The share of independent rows at which models are compared: that of the best of them. What a worse one lacks lasts from row to row in its
/// residual, and would pass for noise.
fn compared_at<P: Problem>(problem: &P, fit: &P::Fit, trials: &[Trial<P>]) -> f64 {
    let all = || std::iter::once(fit).chain(trials.iter().map(|trial| &trial.fit));
    let most = all()
        .map(|fit| problem.independence(fit))
        .fold(0.0, f64::max);
    let best = all()
        .map(|fit| (problem.log_evidence(fit, most), fit))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let of_best = best.map_or(most, |(_, fit)| problem.independence(fit));
    of_best.max(problem.independence(fit))
}

/// The likeliest of trials, best first, fitted to the end, and the share of independent rows at which it is compared: trials are not, so that
/// one that comes near may be the better one.
fn likeliest<P: Problem>(
    problem: &P,
    from: &P::Fit,
    tried: Vec<Trial<P>>,
    independence: f64,
    options: &Options,
) -> Option<(Trial<P>, f64)> {
    let now = problem.log_evidence(from, independence);
    let best = tried.first()?.log;
    let comes_near = |trial: &Trial<P>| best - trial.log <= NEAR * (best - now).max(0.0);
    let near: Vec<Trial<P>> = tried
        .into_iter()
        .filter(comes_near)
        .take(options.last)
        .collect();
    let settled = near.into_par_iter().map(|trial| Trial {
        fit: problem.settled(&trial.fit),
        ..trial
    });
    let mut all: Vec<Trial<P>> = settled.collect();
    let independence = compared_at(problem, from, &all);
    for trial in &mut all {
        trial.log = problem.log_evidence(&trial.fit, independence);
    }
    let best = all.into_iter().max_by(|a, b| a.log.total_cmp(&b.log))?;
    Some((best, independence))
}

/// The new member of a trial as fitted; none where it is not in the fit.
fn standing<P: Problem>(problem: &P, trial: &Trial<P>) -> Option<Accepted<P::Key>> {
    let mut set = problem.set(&trial.fit).into_iter().rev();
    set.find(|one| one.cell.key == trial.cell.key)
}

/// The likeliest set from a fit on: a pure function of the problem and its start.
fn search<P: Problem>(
    problem: &P,
    start: P::Fit,
    seen: Option<&P::Around>,
    options: &Options,
    tell: &mut impl FnMut(String),
) -> Stand<P> {
    let mut stand = Stand::new(problem, start, seen);
    // A fit to the end may lose what the trial promised: then the same cells would come and go for ever.
    for _ in 0..ROUNDS * options.most {
        if problem.set(&stand.fit).len() >= options.most {
            break;
        }
        let independence = problem.independence(&stand.fit);
        let now = problem.log_evidence(&stand.fit, independence);
        let set = problem.set(&stand.fit);
        let scanned = problem.scan(&stand.fit, &stand.around, None);
        let asked = candidates(problem, scanned, &set, f64::NEG_INFINITY, options);
        let least = now + options.joins;
        let near = |first: f64| now + (1.0 - BLUR_SHARE) * (first - now);
        let (tried, independence) = trials(problem, &stand.fit, &set, asked, least, near);
        let now = problem.log_evidence(&stand.fit, independence);
        for trial in tried.iter().take(4) {
            let (name, place) = (&trial.cell.cause.name, &trial.cell.place);
            tell(format!(
                "  {name} at {place}: ln odds {:.1}",
                trial.log - now
            ));
        }
        let strong = tried
            .first()
            .is_some_and(|best| best.log - now >= options.joins);
        let best = strong.then(|| likeliest(problem, &stand.fit, tried, independence, options));
        let Some((best, _)) = best.flatten() else {
            break;
        };
        tell(format!(
            "{} at {} joins",
            best.cell.cause.name, best.cell.place
        ));
        let newest = problem.set(&best.fit).len().saturating_sub(1);
        let fit = revised(problem, best.fit, newest, options, tell);
        if !problem.is_accurate(&fit) {
            return Stand {
                fit,
                is_accurate: false,
                ..stand
            };
        }
        stand = Stand::new(problem, fit, Some(&stand.around));
    }
    stand
}

/// Of the first `count` members those are dropped that the others made useless; what others need stays.
fn revised<P: Problem>(
    problem: &P,
    mut fit: P::Fit,
    mut count: usize,
    options: &Options,
    tell: &mut impl FnMut(String),
) -> P::Fit {
    let mut at = 0;
    while at < count.min(problem.set(&fit).len()) {
        let independence = problem.independence(&fit);
        let set = problem.set(&fit);
        let rest = without(&set, at);
        let odds = problem.odds(&fit, at, independence);
        if odds.is_some_and(|odds| odds > options.leaves + BLUR) || !is_whole(&rest) {
            at += 1;
            continue;
        }
        let now = problem.log_evidence(&fit, independence);
        let without = problem.fit(&rest, Some(&fit), now - options.leaves);
        let log = problem.log_evidence(&without, independence);
        if now - log < options.leaves {
            let cell = &set[at].cell;
            tell(format!("{} at {} leaves", cell.cause.name, cell.place));
            fit = problem.settled(&without);
            count -= 1;
            continue;
        }
        at += 1;
    }
    fit
}

/// What stands with what else could, up to the first change for the better.
struct Posterior<P: Problem> {
    findings: Vec<Finding<P::Key>>,
    better: Option<Change<P>>,
}

/// What goes and comes, in words, and the fit then.
struct Change<P: Problem> {
    said: String,
    fit: P::Fit,
}

/// Which changes for the better end the question what else could stand.
#[derive(Clone, Copy, PartialEq)]
enum Until {
    /// A member that is useless, or one that another explains better.
    Better,
    /// A member that is useless.
    Useless,
    /// None: the set is what it is.
    End,
}

impl<P: Problem> Change<P> {
    fn of(trial: Trial<P>, gone: &str) -> Self {
        let (name, place) = (&trial.cell.cause.name, &trial.cell.place);
        Self {
            said: format!("{name} at {place} in place of {gone}"),
            fit: trial.fit,
        }
    }
}

/// One cell in place of all members of a place that has several: causes that stand for parts of another each explain what the others leave, so
/// that it can replace none of them alone.
fn grouped<P: Problem>(problem: &P, stand: &Stand<P>, options: &Options) -> Option<Change<P>> {
    let set = problem.set(&stand.fit);
    let mut places: Vec<&str> = set.iter().map(|one| one.cell.place.as_str()).collect();
    places.sort_unstable();
    places.dedup();
    for place in places {
        let elsewhere = |one: &&Accepted<P::Key>| one.cell.place != place;
        let rest: Vec<Accepted<P::Key>> = set.iter().filter(elsewhere).cloned().collect();
        if set.len() - rest.len() < SEVERAL {
            continue;
        }
        let without = problem.fit(&rest, Some(&stand.fit), f64::NEG_INFINITY);
        let around = problem.around(&without, Some(&stand.around));
        let scanned = problem.scan(&without, &around, None);
        let asked = candidates(problem, scanned, &rest, f64::NEG_INFINITY, options);
        let least = problem.log_evidence(&without, problem.independence(&without));
        let near = |first: f64| least + (1.0 - BLUR_SHARE) * (first - least);
        let (tried, compared) = trials(problem, &without, &rest, asked, least, near);
        let Some((best, compared)) = likeliest(problem, &without, tried, compared, options) else {
            continue;
        };
        let compared = compared.max(problem.independence(&stand.fit));
        let of = |fit: &P::Fit| problem.log_evidence(fit, compared);
        if of(&best.fit) - of(&stand.fit) > options.exchanges {
            return Some(Change::of(best, &format!("all at {place}")));
        }
    }
    None
}

/// What stands, each with what else could stand in its place; up to the first change for the better that is asked for.
fn posterior<P: Problem>(
    problem: &P,
    stand: &Stand<P>,
    until: Until,
    options: &Options,
) -> Posterior<P> {
    let fit = &stand.fit;
    let set = problem.set(fit);
    let independence = problem.independence(fit);
    let now = problem.log_evidence(fit, independence);
    let mut findings: Vec<Finding<P::Key>> = Vec::new();
    for (at, accepted) in set.iter().enumerate() {
        let own = &accepted.cell;
        let rest = without(&set, at);
        let without = problem.fit(&rest, Some(fit), f64::NEG_INFINITY);
        let none = problem.log_evidence(&without, independence);
        let scanned = problem.scan(fit, &stand.around, Some(at));
        let is_other = |one: &Scanned<P::Key>| !problem.is_same(&one.accepted, accepted);
        let others = scanned.into_iter().filter(is_other);
        let lost = now - none;
        if lost < options.leaves && until != Until::End && is_whole(&rest) {
            let better = Some(Change {
                said: format!("{} at {} leaves", own.cause.name, own.place),
                fit: without,
            });
            return Posterior { findings, better };
        }
        let least = lost - BLUR.max(BLUR_SHARE * lost);
        let asked = candidates(problem, others.collect(), &rest, least, options);
        let told = options.told.ln();
        let least = log_sum(&[now, none]) + told;
        let (mut others, compared) =
            trials(problem, fit, &rest, asked, least, |first| first + told);
        let now = problem.log_evidence(fit, compared);
        let none = problem.log_evidence(&without, compared);
        let lost = now - none;
        let is_better = |trial: &Trial<P>| trial.log - now > options.exchanges;
        if until == Until::Better && others.first().is_some_and(is_better) {
            let other = others.remove(0);
            let gone = format!("{} at {}", own.cause.name, own.place);
            let better = Some(Change::of(other, &gone));
            return Posterior { findings, better };
        }
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
                accepted: standing(problem, trial).unwrap_or_else(|| accepted.clone()),
                probability: share(trial.log),
                log_odds: trial.log - now,
            })
            .filter(|rival| rival.probability >= options.told)
            .collect();
        findings.push(Finding {
            accepted: accepted.clone(),
            probability: share(now),
            place_probability: (share(now) + here).min(1.0),
            none_probability: share(none),
            log_odds: lost,
            rivals,
        });
    }
    findings.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    Posterior {
        findings,
        better: None,
    }
}

/// What a set says as it is, each member with what else could stand in its place, strongest first.
pub fn findings<P: Problem>(
    problem: &P,
    set: &[Accepted<P::Key>],
    options: &Options,
) -> Vec<Finding<P::Key>> {
    let fit = problem.fit(set, None, f64::NEG_INFINITY);
    let stand = Stand::new(problem, fit, None);
    posterior(problem, &stand, Until::End, options).findings
}

/// The fit of a set without its members that are useless; what others need stays.
pub fn dropped<P: Problem>(
    problem: &P,
    set: &[Accepted<P::Key>],
    options: &Options,
    mut tell: impl FnMut(String),
) -> P::Fit {
    let fit = problem.fit(set, None, f64::NEG_INFINITY);
    revised(problem, fit, set.len(), options, &mut tell)
}

/// Searches from a set on until nothing changes, and says what stands.
pub fn diagnose<P: Problem>(
    problem: &P,
    start: &[Accepted<P::Key>],
    options: &Options,
    mut tell: impl FnMut(String),
) -> Answer<P> {
    let before = problem.fit(&[], None, f64::NEG_INFINITY);
    let begun = match start {
        [] => before.clone(),
        set => problem.fit(set, None, f64::NEG_INFINITY),
    };
    let mut stand = search(problem, begun, None, options, &mut tell);
    let mut exchanges = 0;
    let findings = loop {
        if !stand.is_accurate {
            break Vec::new();
        }
        let until = match exchanges < options.exchanged {
            true => Until::Better,
            false => Until::Useless,
        };
        let found = posterior(problem, &stand, until, options);
        let better = found.better.or_else(|| {
            (until == Until::Better && options.regroups)
                .then(|| grouped(problem, &stand, options))
                .flatten()
        });
        let Some(Change { said, fit }) = better else {
            break found.findings;
        };
        tell(said);
        let fit = problem.settled(&fit);
        let newest = problem.set(&fit).len().saturating_sub(1);
        let fit = revised(problem, fit, newest, options, &mut tell);
        stand = match exchanges < options.exchanged {
            true => search(problem, fit, Some(&stand.around), options, &mut tell),
            false => Stand::new(problem, fit, Some(&stand.around)),
        };
        exchanges += 1;
    };
    Answer {
        before,
        is_accurate: stand.is_accurate,
        after: stand.fit,
        findings,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Cause;

    /// Two cells of which a trial has both, and a fit to the end only the newest.
    struct OneOfTwo;

    fn cell(key: usize) -> Accepted<usize> {
        let cell = Cell {
            key,
            cause: Cause::named(["first", "second"][key].into()),
            place: "here".into(),
            log_prior: 0.0,
            shapes: Vec::new(),
            needs: Vec::new(),
        };
        Accepted {
            cell,
            shape: 0,
            numbers: vec![1.0],
        }
    }

    impl Problem for OneOfTwo {
        type Key = usize;
        type Fit = Vec<usize>;
        type Around = ();

        fn around(&self, _fit: &Vec<usize>, _before: Option<&()>) {}

        fn scan(&self, fit: &Vec<usize>, _around: &(), _out: Option<usize>) -> Vec<Scanned<usize>> {
            let missing = (0..2).filter(|key| !fit.contains(key));
            let scanned = |key| Scanned {
                accepted: cell(key),
                log_odds: 10.0,
            };
            missing.map(scanned).collect()
        }

        fn fit(
            &self,
            set: &[Accepted<usize>],
            _before: Option<&Vec<usize>>,
            _least: f64,
        ) -> Vec<usize> {
            set.iter().map(|one| one.cell.key).collect()
        }

        fn settled(&self, fit: &Vec<usize>) -> Vec<usize> {
            fit.last().copied().into_iter().collect()
        }

        fn set(&self, fit: &Vec<usize>) -> Vec<Accepted<usize>> {
            fit.iter().map(|key| cell(*key)).collect()
        }

        fn log_evidence(&self, fit: &Vec<usize>, _independence: f64) -> f64 {
            10.0 * fit.len() as f64
        }
    }

    #[test]
    fn cells_that_leave_when_another_is_fitted_to_the_end_do_not_come_and_go_for_ever() {
        let answer = diagnose(&OneOfTwo, &[], &Options::default(), |_| ());
        assert_eq!(answer.after.len(), 1);
    }
}
