//! One identification: fit all that is asked under its tolerances, robustly, learn how much stays unmodelled, state the uncertainty.
//!
//! Nothing is held: every parameter has a prior ([`Model::prior`]), so that a direction in which the data say nothing stays at nominal in the
//! proportions in which arms are made badly, and every standard deviation is that of data and prior together.

use super::cluster::clustered;
use super::covariance::Covariance;
use super::factor::TriangularFactor;
use super::levenberg::{Effort, FINE, Iteration, ROUGH_TOLERANCE, Stop, minimise};
use super::model::{Model, PriorCheck};
use super::observe::indices;
use super::problem::{Evaluation, Problem, as_of_three, bound, columns, share};
use super::repeats::{Poses, Repeated, autocorrelation_time};
use crate::effect::{Place, names};
use crate::observation::{Dimension, ExcessSigma, Residual};
use crate::robot::Measurements;
use crate::statistics::{MEDIAN_CHI2, nearest};
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::sync::Arc;

/// How a fit treated a parameter of the stack.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterStatus {
    /// Estimated, with its standard deviation (SI) from data and prior together.
    Free(f64),
    /// On a bound that it would have to cross; with the value that the data would have (SI).
    Bound(f64),
    /// Not a candidate: kept.
    Kept,
}

/// How much of a parameter the data tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Determined {
    /// They know it better than half of its tolerance.
    Determined,
    /// They narrow its tolerance.
    Partly,
    /// It stands where its tolerance leaves it.
    ByTolerance,
}

/// Standard deviations below this share of the tolerance are of parameters that the data determine ...
const DETERMINED: f64 = 0.5;
/// ... and above this they add nothing to it.
const BY_TOLERANCE: f64 = 0.9;

impl Determined {
    /// By the standard deviations before and after the measurement.
    pub fn of(tolerance: f64, sigma: f64) -> Self {
        match sigma / tolerance {
            share if share < DETERMINED => Self::Determined,
            share if share <= BY_TOLERANCE => Self::Partly,
            _ => Self::ByTolerance,
        }
    }

    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Determined => "determined",
            Self::Partly => "partly",
            Self::ByTolerance => "by tolerance",
        }
    }
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
    /// Singular values of the data, columns scaled by prior sigma, largest first: of the directions that the data determine, which they know
    /// better than the priors do. So many parameters the fit has used.
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

    /// How much the data tell of a parameter of the model; `None` where it was not estimated.
    pub fn determined(&self, model: &Model, parameter: usize) -> Option<Determined> {
        match self.statuses[parameter] {
            ParameterStatus::Free(sigma) => {
                Some(Determined::of(model.prior(parameter).sigma, sigma))
            }
            _ => None,
        }
    }

    /// Parameters of the model that were estimated and that the data do not determine.
    pub fn undetermined(&self, model: &Model) -> Vec<usize> {
        let all = 0..self.statuses.len();
        let open = |k: &usize| {
            let known = self.determined(model, *k);
            known.is_some_and(|known| known != Determined::Determined)
        };
        all.filter(open).collect()
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
/// Effort of the first round of a search, of those after it, and of the last.
type Efforts = [Effort; 3];
const FROM_THE_START: Efforts = [FIRST, ROUGH, FINE];
const FROM_NEAR: Efforts = [ROUGH, ROUGH, FINE];
/// Whether much less is left is seen after a few steps; along what no tolerance holds it would go on for ever.
const LOOK: Efforts = [FIRST; 3];
/// Parameters of one kind that are farther off than this many of their tolerances, root mean square, are those of an arm that is made worse.
const WORSE: f64 = 2.0;
/// Only where a number is farther off than its tolerance may one be far beyond; ...
const PULLED: f64 = 1.0;
/// Without regard to tolerances: so many times as wide ...
const AFAR: f64 = 100.0;
/// ... where less than this share of what stays unmodelled is left.
const AFAR_WORTH: f64 = 0.5;
/// How often tolerances are learned.
const WIDENINGS: usize = 8;
/// Where at least one row in so many belongs to a repeated pose, rows are clustered.
const REPEATING: usize = 4;
/// Degrees of freedom that the noise of the weights counts as.
const STATED: f64 = 2.0;
/// Rounds of fit and new estimate of the unmodelled part; it settles in two or three.
const ROUNDS: usize = 4;
/// A direction that data know no better than this share of the prior's own information is left to it.
const SEEN: f64 = 1.0;

/// The model with the candidates (parameters of the stack) fitted to some rows under their priors, from its values on. Everything else keeps
/// its value.
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
    // The start may be far off: it is weighted with what is left there.
    let first = problem.evaluate(&model, candidates);
    problem.excess = excess_sigma(&problem, &first, 0);
    let mut search = Minimisation {
        course: Vec::new(),
        stop: Stop::NothingFree,
    };
    search.settle(&mut problem, &mut model, candidates, FROM_THE_START);
    search.settle_from_afar(&mut problem, &mut model, &start.x, candidates);
    for _ in 0..WIDENINGS {
        if !widened(&problem, &mut model, candidates) {
            break;
        }
        search.settle(&mut problem, &mut model, candidates, FROM_NEAR);
    }
    stand_where_found(&mut model, candidates);
    let all = problem.observe(&model, candidates);
    let fitted = stated(&problem, &model, candidates, search, all);
    (model, fitted)
}

/// Lets the corrections of the base count from where it was found: far from there they are no small motions in the axes of the tracker, and a
/// covariance of theirs would be of other numbers than those that a stored model has.
fn stand_where_found(model: &mut Model, candidates: &[usize]) {
    let base: Vec<usize> = model.stack.parameters_of(names::BASE_FRAME).collect();
    if base.is_empty() || !base.iter().all(|k| candidates.contains(k)) {
        return;
    }
    model.stack = Arc::new(model.stack.standing_at(model.base()));
    base.iter().for_each(|k| model.x[*k] = 0.0);
}

/// Widens tolerances that this arm is not made to: first of the one number that is farthest beyond its own, since one wrong number is likelier
/// than a little error of all others that would do the same; then of every kind of parameter that is farther off than arms are made, as far as
/// the data determine them. Never thought smaller than stated. Whether any was widened.
fn widened(problem: &Problem, model: &mut Model, candidates: &[usize]) -> bool {
    let beyond = |k: &usize| model.x[*k].abs() / model.tolerances[*k];
    let farthest = candidates
        .iter()
        .copied()
        .filter(|k| beyond_tolerance(model, *k).is_some() && beyond(k) > BEYOND)
        .max_by(|a, b| beyond(a).total_cmp(&beyond(b)));
    if let Some(k) = farthest {
        model.tolerances[k] = model.x[k].abs();
        return true;
    }
    let Some(inverse) = problem.evaluate(model, candidates).factor.inverse() else {
        return false;
    };
    let specs = model.stack.specs();
    let mut kinds: BTreeMap<(&str, &str), (f64, f64, Vec<usize>)> = BTreeMap::new();
    for (row, k) in candidates.iter().enumerate() {
        if model.known(*k).prior.is_some() {
            continue;
        }
        let effect = specs[*k].name.split('.').next().unwrap_or_default();
        let kind = kinds.entry((effect, specs[*k].unit.symbol())).or_default();
        let tolerance = model.tolerances[*k];
        kind.0 += (model.x[*k] / tolerance).powi(2);
        kind.1 += (1.0 - (inverse.row_norm(row) / tolerance).powi(2)).max(0.0);
        kind.2.push(*k);
    }
    let worse = |(square, told, _): &(f64, f64, Vec<usize>)| {
        (*told >= 1.0 && *square > WORSE * WORSE * told).then(|| (square / told).sqrt())
    };
    let wider: Vec<(Vec<usize>, f64)> = kinds
        .into_values()
        .filter_map(|kind| worse(&kind).map(|times| (kind.2, times)))
        .collect();
    for (parameters, times) in &wider {
        parameters
            .iter()
            .for_each(|k| model.tolerances[*k] *= times);
    }
    !wider.is_empty()
}

/// A number that is farther from nominal than this many tolerances is no matter of how arms are made.
const BEYOND: f64 = 4.0;

/// How many of its tolerances a number of the arm is off, where these are more than four.
pub fn beyond_tolerance(model: &Model, parameter: usize) -> Option<f64> {
    let spec = &model.stack.specs()[parameter];
    let of_the_arm = !matches!(spec.place, Place::Base | Place::Anchor);
    let times = model.x[parameter].abs() / spec.tolerance;
    let is_known = model.known(parameter).prior.is_some();
    (of_the_arm && !is_known && times > BEYOND).then_some(times)
}

/// How many directions of some parameters are known better than their tolerances leave them, whatever the others are: by the data, or by a
/// prior that was stated.
pub fn determined_directions(model: &Model, fitted: &Fitted, parameters: &[usize]) -> usize {
    let covariance = fitted.covariance.as_ref();
    let block = covariance.and_then(|all| all.block(parameters));
    let Some(covariance) = block.filter(|block| !block.is_empty()) else {
        return 0;
    };
    let scale = |i: usize| model.tolerances[parameters[i]];
    let size = covariance.nrows();
    let scaled = DMatrix::from_fn(size, size, |i, j| {
        covariance[(i, j)] / (scale(i) * scale(j))
    });
    let shares = scaled.symmetric_eigenvalues();
    shares.iter().filter(|share| **share < 0.5).count()
}

/// How many of the singular values, largest first, are of directions that the data determine.
fn determined(singular: &[f64]) -> usize {
    singular.iter().filter(|value| **value > SEEN).count()
}

/// What the data (`all`: in all candidates, at the minimum) say of a fitted model.
fn stated(
    problem: &Problem,
    model: &Model,
    candidates: &[usize],
    search: Minimisation,
    all: Evaluation,
) -> Fitted {
    let Minimisation { course, stop } = search;
    let mut statuses = vec![ParameterStatus::Kept; model.x.len()];
    for k in candidates {
        statuses[*k] = ParameterStatus::Free(f64::NAN);
    }
    let free = candidates.to_vec();
    let errors = problem.errors(&all.residuals);
    let place = columns(model, candidates);
    let only = |free: &[usize]| {
        let places: Vec<usize> = free.iter().filter_map(|k| place[*k]).collect();
        all.factor.select(&places)
    };
    let factor = model.with_priors(&free, only(&free));
    let pinned = model.pinned(&free, &factor);
    bounded(model, &free, &pinned, &factor, &mut statuses);
    let free: Vec<usize> = free
        .into_iter()
        .zip(pinned)
        .filter(|(_, pinned)| !pinned)
        .map(|(k, _)| k)
        .collect();
    let data = only(&free);
    let singular_all = problem
        .shown(model, candidates)
        .unwrap_or_else(|| all.factor.clone())
        .singular_values(&model.prior_sigmas(candidates));
    let singular = singular_all[..determined(&singular_all)].to_vec();
    // The noise is known up to a factor, what was known beforehand is not.
    let scale = reduced(&errors, singular.len()).sqrt() * lasting(problem, &all.residuals).sqrt();
    let weight = if scale > 0.0 { 1.0 / scale } else { 1.0 };
    let poses = Poses::of(problem.data, problem.rows);
    let clusters = clusters(&poses, problem.rows.len(), singular.len());
    let inverse = |data| model.with_priors(&free, data).inverse();
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
            singular.len(),
        ),
        clusters: clusters.map_or(0, <[Vec<usize>]>::len),
        downweighted: downweighted(&all.residuals, &errors),
        indices: indices(&singular, problem.rows.len()),
        singular,
        singular_all,
    }
}

/// The way to a minimum.
struct Minimisation {
    course: Vec<Iteration>,
    stop: Stop,
}

impl Minimisation {
    /// What stays unmodelled may be a number that is far beyond its tolerance, which a noise as large hides: where the rows are fitted far better
    /// without regard to tolerances, it goes on from there. A fit that `began` there has been asked before.
    fn settle_from_afar(
        &mut self,
        problem: &mut Problem,
        model: &mut Model,
        began: &[f64],
        candidates: &[usize],
    ) {
        let near = problem.excess;
        let is_off = |x: &[f64], k: usize| x[k].abs() > PULLED * model.tolerances[k];
        let pulled = |k: &usize| is_off(&model.x, *k) && !is_off(began, *k);
        if near == ExcessSigma::default() || !candidates.iter().any(pulled) {
            return;
        }
        let (x, tolerances) = (model.x.clone(), model.tolerances.clone());
        let (stop, steps) = (self.stop, self.course.len());
        candidates.iter().for_each(|k| model.tolerances[*k] *= AFAR);
        self.settle(problem, model, candidates, LOOK);
        model.tolerances = tolerances;
        let far = problem.excess;
        if far.length < AFAR_WORTH * near.length || far.angle < AFAR_WORTH * near.angle {
            self.settle(problem, model, candidates, FROM_NEAR);
        } else {
            model.x = x;
            problem.excess = near;
            self.stop = stop;
            self.course.truncate(steps);
        }
    }

    /// Rounds of fitting the candidates and learning how much stays unmodelled.
    fn settle(
        &mut self,
        problem: &mut Problem,
        model: &mut Model,
        candidates: &[usize],
        [first, then, last]: Efforts,
    ) {
        for round in 0..ROUNDS {
            let effort = match round {
                0 => first,
                round if round + 1 < ROUNDS => then,
                _ => last,
            };
            let start = problem.evaluate(model, candidates);
            let (steps, mut stop, mut end) = minimise(problem, model, candidates, start, effort);
            self.course.extend(steps);
            let used = |end: &Evaluation, model: &Model| {
                // Those of data and priors together: squares are one more.
                let both = end.factor.singular_values(&model.prior_sigmas(candidates));
                both.iter()
                    .filter(|value| *value * *value > 1.0 + SEEN * SEEN)
                    .count()
            };
            let mut next = excess_sigma(problem, &end, used(&end, model));
            let same = |one: f64, other: f64| (one - other).abs() <= 0.02 * one.max(other);
            let settled =
                same(next.length, problem.excess.length) && same(next.angle, problem.excess.angle);
            if settled && effort.tolerance > last.tolerance {
                let steps;
                (steps, stop, end) = minimise(problem, model, candidates, end, last);
                self.course.extend(steps.into_iter().skip(1));
                next = excess_sigma(problem, &end, used(&end, model));
            }
            self.stop = stop;
            problem.excess = next;
            if settled {
                break;
            }
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
