//! One identification: choose what the data can see, fit it robustly, learn how much stays unmodelled, state the uncertainty.

use super::cluster::clustered;
use super::covariance::Covariance;
use super::factor::TriangularFactor;
use super::levenberg::{Effort, FINE, Iteration, ROUGH_TOLERANCE, Stop, minimise};
use super::model::{Model, PriorCheck};
use super::observe::{Visibility, indices, visibility};
use super::problem::{Evaluation, Problem, as_of_three, bound, columns, share};
use super::repeats::{Poses, Repeated, autocorrelation_time};
use crate::observation::{Dimension, ExcessSigma, Residual};
use crate::robot::Measurements;
use crate::statistics::{MEDIAN_CHI2, nearest};
use std::collections::BTreeMap;

/// How a fit treated a parameter of the stack.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterStatus {
    /// Estimated, with its standard deviation (SI).
    Free(f64),
    /// On a bound that it would have to cross; with the value that the data would have (SI).
    Bound(f64),
    /// Not a candidate: kept.
    Kept,
    /// As [`Visibility::Redundant`], with positions in the stack.
    Redundant(Vec<(usize, f64)>),
    /// The data do not show it.
    Unseen,
}

/// What [`fit`] says of the model that it returns.
#[derive(Clone)]
pub struct Fitted {
    /// The state of every parameter of the stack.
    pub statuses: Vec<ParameterStatus>,
    /// Step by step.
    pub course: Vec<Iteration>,
    /// Why it ended.
    pub stop: Stop,
    /// Standard deviation per axis that the rows show beyond the instrument's, m.
    pub excess_sigma: f64,
    /// The same about each axis, rad, where angles were measured.
    pub excess_sigma_angle: Option<f64>,
    /// Numbers that were measured in the fitted rows.
    pub values: usize,
    /// Fitted rows of which something has a Huber weight below one, with the smallest such weight.
    pub downweighted: BTreeMap<usize, f64>,
    /// Parameters with a prior: what it says against what the data say.
    pub prior_checks: BTreeMap<usize, PriorCheck>,
    /// Singular values of the free parameters (priors included) scaled by prior sigma, largest first.
    pub singular: Vec<f64>,
    /// Singular values of all candidates, to show the gap behind the rank.
    pub singular_all: Vec<f64>,
    /// What poses measured more than once say.
    pub repeated: Option<Repeated>,
    /// Poses whose rows were taken as one by the covariance; 0 where rows were taken as independent.
    pub clusters: usize,
    /// By what the standard deviations are larger than those of the stated noise.
    pub noise_scale: f64,
    /// Covariance of the free parameters; `None` where the factor is singular.
    pub covariance: Option<Covariance>,
    /// (name, value, meaning).
    pub indices: Vec<(&'static str, f64, &'static str)>,
}

/// A recording with the model fitted to some of its rows.
#[derive(Clone, Copy)]
pub struct Session<'a> {
    /// The recording.
    pub data: &'a Measurements,
    /// Rows that are fitted.
    pub rows: &'a [usize],
    /// As it was fitted.
    pub model: &'a Model,
    /// How the fit went.
    pub fitted: &'a Fitted,
}

impl<'a> Session<'a> {
    /// What was minimised.
    pub(crate) fn problem(&self) -> Problem<'a> {
        Problem::new(self.data, self.rows, self.fitted.excess())
    }
}

impl Fitted {
    /// Parameters that were estimated.
    pub fn free(&self) -> Vec<usize> {
        self.with_status(|status| matches!(status, ParameterStatus::Free(_)))
    }

    /// The same with those that a bound stops.
    pub(crate) fn estimated(&self) -> Vec<usize> {
        use ParameterStatus::{Bound, Free};
        self.with_status(|status| matches!(status, Free(_) | Bound(_)))
    }

    pub(crate) fn with_status(&self, is: impl Fn(&ParameterStatus) -> bool) -> Vec<usize> {
        let all = 0..self.statuses.len();
        all.filter(|k| is(&self.statuses[*k])).collect()
    }

    /// What the rows show beyond their own noise.
    pub(crate) fn excess(&self) -> ExcessSigma {
        ExcessSigma {
            length: self.excess_sigma,
            angle: self.excess_sigma_angle.unwrap_or_default(),
        }
    }
}

/// Effort of rounds whose weights are not settled.
const ROUGH: Effort = Effort {
    tolerance: ROUGH_TOLERANCE,
    ..FINE
};
/// Effort of the first round, which only finds out how large the residual is and what it lets one see.
const FIRST: Effort = Effort { limit: 4, ..ROUGH };
/// A parameter that the nominal robot hid is taken up where the data know it this many times better than its prior sigma ...
pub const CLEARLY: f64 = 10.0;
/// ... and where they lower the cost by this and so much for each further one: chi-square as rare as five sigmas, so that
/// hundreds of robots of one kind keep one set of parameters.
const WORTH: [f64; 2] = [12.5, 1.75];
/// Where at least one row in so many belongs to a repeated pose, rows are clustered.
const REPEATING: usize = 4;
/// Degrees of freedom that the noise of the weights counts as.
const STATED: f64 = 2.0;
/// Rounds of fit and new estimate of the unmodelled part; it settles in two or three.
const ROUNDS: usize = 4;

/// The model with those of the candidates (parameters of the stack in order of precedence) fitted to some rows that the data can see, from
/// its values on. Everything else keeps its value.
pub fn fit(
    start: &Model,
    data: &Measurements,
    rows: &[usize],
    candidates: &[usize],
) -> (Model, Fitted) {
    let mut model = start.clone();
    let mut problem = Problem::new(data, rows, ExcessSigma::default());
    for k in candidates {
        model.x[*k] = model.within(*k, model.x[*k]);
    }
    // The start may be far off: judge visibility with the instrument's noise, weight with what is left at the start.
    let sight = problem.evaluate(&model, candidates);
    problem.excess = excess_sigma(&problem, &sight, 0);
    let mut search = Minimisation {
        statuses: vec![ParameterStatus::Kept; model.x.len()],
        course: Vec::new(),
        stop: Stop::NothingFree,
        free: Vec::new(),
    };
    search.settle(&mut problem, &mut model, candidates, sight, true);
    let mut all = problem.observe(&model, candidates);
    let shown = problem
        .shown(&model, candidates)
        .unwrap_or_else(|| all.factor.clone());
    if search.reconsider(&mut problem, &mut model, candidates, shown) {
        all = problem.observe(&model, candidates);
    }
    let fitted = stated(&problem, &model, candidates, search, all);
    (model, fitted)
}

/// Which of some further parameters the data can see around a fitted model next to those that were fitted, `times` better than their priors.
pub fn seen(session: &Session, further: &[usize], times: f64) -> Vec<usize> {
    let model = session.model;
    let known = session.fitted.free();
    let candidates: Vec<usize> = known.iter().chain(further).copied().collect();
    let prior = |k: &usize| match known.contains(k) {
        true => f64::INFINITY,
        false => model.stack.specs()[*k].prior_sigma / times,
    };
    let seen = visibility(
        &session.problem().observe(model, &candidates).factor,
        &candidates.iter().map(prior).collect::<Vec<_>>(),
    );
    picked(&candidates, &seen)
        .filter(|k| further.contains(k))
        .collect()
}

/// The candidates that are seen.
fn picked<'a>(candidates: &'a [usize], seen: &'a [Visibility]) -> impl Iterator<Item = usize> + 'a {
    let pairs = candidates.iter().zip(seen);
    pairs
        .filter(|(_, verdict)| **verdict == Visibility::Seen)
        .map(|(k, _)| *k)
}

fn prior_sigmas(model: &Model, parameters: &[usize]) -> Vec<f64> {
    let specs = model.stack.specs();
    parameters.iter().map(|k| specs[*k].prior_sigma).collect()
}

/// What the data (`all`: in all candidates, at the minimum) say of a fitted model.
fn stated(
    problem: &Problem,
    model: &Model,
    candidates: &[usize],
    search: Minimisation,
    all: Evaluation,
) -> Fitted {
    let Minimisation {
        mut statuses,
        course,
        stop,
        free,
    } = search;
    let errors = problem.errors(&all.residuals);
    let place = columns(model, candidates);
    let only = |free: &[usize]| {
        let places: Vec<usize> = free.iter().filter_map(|k| place[*k]).collect();
        all.factor.select(&places)
    };
    let (factor, _) = model.with_priors(&free, only(&free));
    let pinned = model.pinned(&free, &factor);
    bounded(model, &free, &pinned, &factor, &mut statuses);
    let free: Vec<usize> = free
        .into_iter()
        .zip(pinned)
        .filter(|(_, pinned)| !pinned)
        .map(|(k, _)| k)
        .collect();
    let data = only(&free);
    // The noise is known up to a factor, what was known beforehand is not.
    let scale = reduced(&errors, free.len()).sqrt() * lasting(problem, &all.residuals).sqrt();
    let weight = if scale > 0.0 { 1.0 / scale } else { 1.0 };
    let poses = Poses::of(problem.data, problem.rows);
    let clusters = clusters(&poses, problem.rows.len(), free.len());
    let inverse = |data| model.with_priors(&free, data).0.inverse();
    let root = match clusters {
        Some(poses) => {
            inverse(data.clone()).map(|inverse| clustered(problem, model, &free, &inverse, poses))
        }
        None => inverse(data.clone().weighted(weight)),
    };
    let covariance = root.map(|root| Covariance::new(root, &free));
    let mut prior_checks = BTreeMap::new();
    if let Some(covariance) = &covariance {
        for (row, k) in free.iter().enumerate() {
            let sigma = covariance.sigma(row);
            statuses[*k] = ParameterStatus::Free(sigma);
            if let Some(prior) = model.known(*k).prior {
                prior_checks.insert(*k, PriorCheck::of(prior, model.x[*k], sigma * sigma));
            }
        }
    }
    let has_angles = all
        .residuals
        .iter()
        .any(|residual| residual.dimension() == Dimension::Angle);
    let (factor, _) = model.with_priors(&free, data);
    let singular = factor.singular_values(&prior_sigmas(model, &free));
    let singular_all = match problem.shown(model, candidates) {
        None if free == candidates => singular.clone(),
        shown => model
            .with_priors(candidates, shown.unwrap_or(all.factor))
            .0
            .singular_values(&prior_sigmas(model, candidates)),
    };
    Fitted {
        statuses,
        course,
        stop,
        excess_sigma: problem.excess.length,
        excess_sigma_angle: has_angles.then_some(problem.excess.angle),
        values: errors.iter().map(|(_, axes)| axes).sum(),
        noise_scale: 1.0 / weight,
        covariance,
        prior_checks,
        repeated: poses.against(
            model,
            problem.data,
            whole_points(&all.residuals),
            free.len(),
        ),
        clusters: clusters.map_or(0, <[Vec<usize>]>::len),
        downweighted: downweighted(&all.residuals, &errors),
        indices: indices(&singular, problem.rows.len()),
        singular,
        singular_all,
    }
}

/// The way to a minimum in what the data see.
struct Minimisation {
    statuses: Vec<ParameterStatus>,
    course: Vec<Iteration>,
    stop: Stop,
    /// What was estimated last.
    free: Vec<usize>,
}

impl Minimisation {
    /// Takes up candidates that the nominal robot hid and the identified one (`all`, the data in all candidates there) shows: a
    /// point meant to lie on the last axis never does. Whether any was worth it; else the model is as before.
    fn reconsider(
        &mut self,
        problem: &mut Problem,
        model: &mut Model,
        candidates: &[usize],
        all: TriangularFactor,
    ) -> bool {
        // What is estimated comes first, so that only what it cannot do counts as new.
        let (sight, _) = model.with_priors(candidates, all);
        let mut order: Vec<usize> = (0..candidates.len()).collect();
        order.sort_by_key(|j| !self.free.contains(&candidates[*j]));
        let ordered: Vec<usize> = order.iter().map(|j| candidates[*j]).collect();
        let mut wary = prior_sigmas(model, &ordered);
        wary.iter_mut().for_each(|sigma| *sigma /= CLEARLY);
        let seen = visibility(&sight.select(&order), &wary);
        let known = self.free.len();
        let new: Vec<usize> = picked(&ordered[known..], &seen[known..]).collect();
        if new.is_empty() {
            return false;
        }
        let free: Vec<usize> = candidates
            .iter()
            .copied()
            .filter(|k| self.free.contains(k) || new.contains(k))
            .collect();
        let (before, start) = (model.x.clone(), problem.evaluate(model, &free));
        let cost = start.objective();
        let (_, stop, end) = minimise(problem, model, &free, start, FINE);
        if stop != Stop::Converged
            || cost - end.objective() < WORTH[0] + WORTH[1] * (new.len() - 1) as f64
        {
            model.x = before;
            return false;
        }
        self.settle(problem, model, &free, end, false);
        true
    }

    /// Rounds of choosing what is seen of the candidates, fitting it, and learning how much stays unmodelled, from `sight`, the
    /// problem in all candidates; far from the solution at the `first` time.
    fn settle(
        &mut self,
        problem: &mut Problem,
        model: &mut Model,
        candidates: &[usize],
        mut sight: Evaluation,
        first: bool,
    ) {
        let mut candidates = candidates.to_vec();
        for round in 0..ROUNDS {
            let prior = prior_sigmas(model, &candidates);
            let shown = problem
                .shown(model, &candidates)
                .map(|factor| model.with_priors(&candidates, factor).0);
            let seen = visibility(shown.as_ref().unwrap_or(&sight.factor), &prior);
            for (k, verdict) in candidates.iter().zip(&seen) {
                self.statuses[*k] = match verdict {
                    Visibility::Seen => ParameterStatus::Free(f64::NAN),
                    Visibility::Unseen => ParameterStatus::Unseen,
                    Visibility::Redundant(with) => ParameterStatus::Redundant(
                        with.iter()
                            .map(|(j, share)| (candidates[*j], *share))
                            .collect(),
                    ),
                };
            }
            let free: Vec<usize> = picked(&candidates, &seen).collect();
            // What is dropped goes back to what was known beforehand and stays there.
            for k in candidates.iter().filter(|k| !free.contains(k)) {
                model.x[*k] = model.prior_value(*k);
            }
            let weighted_so = !first || round > 0 || problem.excess == ExcessSigma::default();
            let start = if weighted_so && free == candidates {
                sight
            } else {
                problem.evaluate(model, &free)
            };
            let effort = if first && round == 0 {
                FIRST
            } else if round + 1 < ROUNDS {
                ROUGH
            } else {
                FINE
            };
            let (steps, mut stop, mut end) = minimise(problem, model, &free, start, effort);
            self.course.extend(steps);
            let mut next = excess_sigma(problem, &end, free.len());
            let same = |one: f64, other: f64| (one - other).abs() <= 0.02 * one.max(other);
            let settled = same(next.length, problem.excess.length)
                && same(next.angle, problem.excess.angle)
                && free.len() == candidates.len();
            if settled && effort.tolerance > FINE.tolerance {
                let steps;
                (steps, stop, end) = minimise(problem, model, &free, end, FINE);
                self.course.extend(steps.into_iter().skip(1));
                next = excess_sigma(problem, &end, free.len());
            }
            self.stop = stop;
            problem.excess = next;
            self.free.clone_from(&free);
            candidates = free;
            if settled {
                break;
            }
            sight = problem.evaluate(model, &candidates);
        }
    }
}

/// What is left of whole points.
fn whole_points(residuals: &[Residual]) -> impl Iterator<Item = &Residual> + Clone {
    residuals
        .iter()
        .filter(|residual| residual.dimension() == Dimension::Length && residual.axes == 3)
}

/// How many rows of a moving arm count as one: what is left on the way lasts from row to row.
fn lasting(problem: &Problem, residuals: &[Residual]) -> f64 {
    if !problem.data.in_motion(problem.rows) {
        return 1.0;
    }
    let whitened: Vec<f64> = whole_points(residuals)
        .flat_map(|residual| {
            let error = residual.whitened(problem.data, problem.excess.length);
            // Gross errors last for one row and would hide that others last longer.
            <[f64; 3]>::from(error * (bound(3) / error.norm().max(bound(3))))
        })
        .collect();
    autocorrelation_time(&whitened, 3)
}

/// The poses, where enough rows repeat one and poses are enough to tell the spread of all parameters.
fn clusters(poses: &Poses, rows: usize, parameters: usize) -> Option<&[Vec<usize>]> {
    let repeated: usize = poses
        .all()
        .iter()
        .filter(|rows| rows.len() > 1)
        .map(Vec::len)
        .sum();
    (REPEATING * repeated >= rows && rows > 0 && poses.all().len() > parameters)
        .then_some(poses.all())
}

/// Names those of the free parameters that a bound stops, with where the data would have each if it alone were let go.
fn bounded(
    model: &Model,
    free: &[usize],
    pinned: &[bool],
    factor: &TriangularFactor,
    statuses: &mut [ParameterStatus],
) {
    for (j, k) in free.iter().enumerate().filter(|(j, _)| pinned[*j]) {
        let fixed: Vec<Option<f64>> = pinned
            .iter()
            .enumerate()
            .map(|(i, pinned)| (*pinned && i != j).then_some(0.0))
            .collect();
        let among = fixed.iter().take(j).filter(|fixed| fixed.is_none()).count();
        let step = factor
            .given(&fixed)
            .solve(0.0)
            .and_then(|step| step.get(among).copied());
        statuses[*k] = ParameterStatus::Bound(model.x[*k] + step.unwrap_or_default());
    }
}

/// Rows with a reduced weight, of residuals with their (error, axes).
fn downweighted(residuals: &[Residual], errors: &[(f64, usize)]) -> BTreeMap<usize, f64> {
    let mut out = BTreeMap::new();
    for (residual, (error, axes)) in residuals
        .iter()
        .zip(errors)
        .filter(|(_, (error, axes))| *error > bound(*axes))
    {
        let weight = share(*error, *axes).powi(2);
        out.entry(residual.row)
            .and_modify(|least: &mut f64| *least = least.min(weight))
            .or_insert(weight);
    }
    out
}

/// Reduced chi-square with Huber's weights, of (error, axes). The weights' own noise counts as [`STATED`] degrees of freedom: a fit with
/// hardly any left cannot say how far points scatter, and one with none knows that noise alone.
fn reduced(errors: &[(f64, usize)], parameters: usize) -> f64 {
    let sum: f64 = errors
        .iter()
        .map(|(e, axes)| e.min(bound(*axes)) * e.min(bound(*axes)))
        .sum();
    let values: usize = errors.iter().map(|(_, axes)| axes).sum();
    (STATED + sum) / (STATED + values.saturating_sub(parameters) as f64)
}

/// The extra standard deviations that bring the median whitened error of lengths, and of angles, to what noise alone would give.
fn excess_sigma(problem: &Problem, at: &Evaluation, parameters: usize) -> ExcessSigma {
    let all: usize = at.residuals.iter().map(|residual| residual.axes).sum();
    let freedom = all.saturating_sub(parameters).max(1) as f64 / all.max(1) as f64;
    let mut errors = Vec::with_capacity(at.residuals.len());
    let mut excess_of = |dimension: Dimension| {
        excess(|extra| {
            let residuals = at
                .residuals
                .iter()
                .filter(|residual| residual.dimension() == dimension);
            let square = |residual: &Residual| {
                residual.whitened(problem.data, extra).norm_squared() * as_of_three(residual.axes)
            };
            errors.clear();
            errors.extend(residuals.map(square));
            (
                nearest(&mut errors, 0.5).unwrap_or(0.0) / freedom,
                errors.len(),
            )
        })
    };
    ExcessSigma {
        length: excess_of(Dimension::Length),
        angle: excess_of(Dimension::Angle),
    }
}

/// The extra standard deviation with which the median squared error (of so many) is that of three unit normals.
fn excess(mut median: impl FnMut(f64) -> (f64, usize)) -> f64 {
    // One sigma of the median's own scatter is no evidence of anything unmodelled.
    let (stated, count) = median(0.0);
    if stated <= MEDIAN_CHI2[3] * (1.0 + 1.6 / (count.max(1) as f64).sqrt()) {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1e-6);
    while median(high).0 > MEDIAN_CHI2[3] && high < 1e3 {
        low = high;
        high *= 4.0;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if median(middle).0 > MEDIAN_CHI2[3] {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}
