//! Levenberg-Marquardt on triangular factors: every way to stop is named, not converging is data.

use crate::estimate::factor::{TriangularFactor, axpy, norm};
use crate::estimate::length::LengthTerm;
use crate::estimate::model::{Known, Model, Prior};
use crate::estimate::problem::{Evaluation, Problem};
use faer::Mat;

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The cost and the parameters no longer change: the minimum.
    Converged,
    /// No step lowers the cost although the gradient is not zero.
    Stalled,
    /// The limit of iterations was reached.
    IterationLimit,
    /// There is nothing to estimate.
    NothingFree,
}

impl Stop {
    /// As tables hold it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Stalled => "stalled",
            Self::IterationLimit => "iteration limit",
            Self::NothingFree => "nothing free",
        }
    }
}

/// One accepted state of the iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// Sum of losses, dimensionless.
    pub cost: f64,
    /// Root mean square of the residual length over the fitted rows, m.
    pub rms: f64,
    /// Largest component of the gradient, in units of (column norm x residual norm): the cosine between them.
    pub gradient: f64,
    /// Norm of the step that led here, in sigmas of prediction.
    pub step_norm: f64,
    /// Damping of the step that was taken.
    pub damping: f64,
}

/// A relative fall of the cost below this is rounding.
const COST_TOLERANCE: f64 = 1e-10;
/// A step that moves all whitened predictions together by less than this (sigmas) changes nothing that data could show ...
pub(crate) const STEP_TOLERANCE: f64 = 1e-3;
/// ... and by less than this nothing that the weights of the next round would be learnt from.
pub(crate) const ROUGH_TOLERANCE: f64 = 0.1;

/// To the minimum; calibration problems need four to ten steps.
pub(crate) const FINE: Effort = Effort {
    limit: 60,
    tolerance: STEP_TOLERANCE,
};

/// How long an iteration goes on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// Most accepted steps.
    pub(crate) limit: usize,
    /// Steps that move the whitened predictions by less than this end it, sigmas.
    pub(crate) tolerance: f64,
}

/// Minimises the problem in the `free` parameters, from and into `model.x`; `now` is the problem there.
///
/// Returns the course, why it stopped, and the problem at the end.
pub(crate) fn minimise(
    problem: &Problem,
    model: &mut Model,
    free: &[usize],
    mut now: Evaluation,
    effort: Effort,
) -> (Vec<Iteration>, Stop, Evaluation) {
    let mut course = vec![iteration(model, free, &now, 0.0, 0.0)];
    if free.is_empty() {
        return (course, Stop::NothingFree, now);
    }
    let mut damping = 0.0;
    for _ in 0..effort.limit {
        let mut tries = 0;
        let (step, next) = loop {
            tries += 1;
            if tries > 20 {
                return (course, Stop::Stalled, now);
            }
            let Some(step) = model.step_within_bounds(free, &now.factor, damping) else {
                damping = raise(damping);
                continue;
            };
            // What is left is below the noise, and the next step would be smaller by orders of magnitude.
            if damping == 0.0 && negligible(&now, &step, effort.tolerance) {
                return (course, Stop::Converged, now);
            }
            let before = model.x.clone();
            for (parameter, change) in free.iter().zip(&step) {
                model.x[*parameter] = model.within(*parameter, model.x[*parameter] + change);
            }
            // Nearly every step is taken, so that its derivatives are worth computing at once.
            let next = problem.evaluate(model, free);
            if next.cost.is_finite() && next.objective() <= now.objective() + 1e-12 * now.cost {
                break (step, next);
            }
            model.x = before;
            if negligible(&now, &step, effort.tolerance) {
                return (course, Stop::Converged, now);
            }
            damping = raise(damping);
        };
        let step_norm = step_norm(&now.factor, &step);
        let fall = now.objective() - next.objective();
        now = next;
        course.push(iteration(model, free, &now, step_norm, damping));
        if step_norm < effort.tolerance || fall <= COST_TOLERANCE * now.cost {
            return (course, Stop::Converged, now);
        }
        damping = if damping < 1e-9 { 0.0 } else { damping / 10.0 };
    }
    (course, Stop::IterationLimit, now)
}

fn iteration(
    model: &Model,
    free: &[usize],
    state: &Evaluation,
    step_norm: f64,
    damping: f64,
) -> Iteration {
    let gradient = cosine(
        &state.factor,
        state.cost,
        &model.pinned(free, &state.factor),
    );
    Iteration {
        cost: state.cost,
        rms: state.rms,
        gradient,
        step_norm,
        damping,
    }
}

/// Whether the step moves no prediction visibly, or promises to lower the cost by no more than rounding.
fn negligible(state: &Evaluation, step: &[f64], tolerance: f64) -> bool {
    let norm = step_norm(&state.factor, step);
    norm < tolerance || 0.5 * norm * norm < COST_TOLERANCE * state.cost
}

fn raise(damping: f64) -> f64 {
    if damping == 0.0 { 1e-6 } else { damping * 10.0 }
}

/// |J dx|: how far a step moves the whitened predictions.
fn step_norm(factor: &TriangularFactor, step: &[f64]) -> f64 {
    let mut moved = vec![0.0; step.len()];
    for (j, change) in step.iter().enumerate() {
        axpy(*change, factor.column(j), &mut moved);
    }
    norm(&moved)
}

/// Largest cosine between the residual and a column of J that no bound stops; zero at the minimum.
fn cosine(factor: &TriangularFactor, cost: f64, pinned: &[bool]) -> f64 {
    let residual = (2.0 * cost).sqrt();
    let gradient = factor.gradient();
    let largest = gradient
        .iter()
        .enumerate()
        .filter(|(j, _)| !pinned[*j])
        .map(|(j, g)| {
            let norm = factor.column_norm(j) * residual;
            if norm > 0.0 { g.abs() / norm } else { 0.0 }
        })
        .fold(0.0, f64::max);
    largest.min(1.0)
}

impl Model {
    /// What is known of a parameter before any measurement: its prior, else its tolerance about nominal.
    pub fn prior(&self, parameter: usize) -> Prior {
        let tolerance = Prior {
            mean: 0.0,
            sigma: self.tolerances[parameter],
        };
        self.known(parameter).prior.unwrap_or(tolerance)
    }

    /// Standard deviations of some parameters before any measurement, SI.
    pub(crate) fn prior_sigmas(&self, parameters: &[usize]) -> Vec<f64> {
        parameters.iter().map(|k| self.prior(*k).sigma).collect()
    }

    /// The nearest allowed value.
    pub(crate) fn within(&self, parameter: usize, value: f64) -> f64 {
        self.known(parameter)
            .bounds
            .map_or(value, |bounds| value.clamp(bounds.low, bounds.high))
    }

    /// Bounds and prior of a parameter.
    pub fn known(&self, parameter: usize) -> Known {
        self.known.get(&parameter).copied().unwrap_or_default()
    }

    /// What is known of the `free` parameters beforehand as rows of a least-squares problem, each by its entries that are not zero and its
    /// error: the prior of each, and every known length.
    fn prior_rows(&self, free: &[usize]) -> impl Iterator<Item = (Vec<(usize, f64)>, f64)> {
        let prior = |(j, k): (usize, &usize)| {
            let prior = self.prior(*k);
            let error = (prior.mean - self.x[*k]) / prior.sigma;
            (vec![(j, 1.0 / prior.sigma)], error)
        };
        let length = |term: LengthTerm| {
            let place = |parameter: usize| free.iter().position(|k| *k == parameter);
            let rates = term.rates.iter();
            let entries = rates.filter_map(|(parameter, rate)| Some((place(*parameter)?, *rate)));
            (entries.collect(), term.error)
        };
        let priors: Vec<_> = free.iter().enumerate().map(prior).collect();
        let lengths: Vec<_> = self.length_terms().map(length).collect();
        priors.into_iter().chain(lengths)
    }

    /// Adds what is known of the `free` parameters beforehand to sums of products (the lower triangle); what it adds to the cost.
    pub(crate) fn add_priors(&self, free: &[usize], products: &mut Mat<f64>) -> f64 {
        let mut cost = 0.0;
        for (mut entries, error) in self.prior_rows(free) {
            cost += 0.5 * error * error;
            entries.push((free.len(), error));
            for (i, a) in &entries {
                let to_the_left = entries.iter().filter(|(j, _)| j <= i);
                to_the_left.for_each(|(j, b)| products[(*i, *j)] += a * b);
            }
        }
        cost
    }

    /// The factor with a row for everything that is known of the `free` parameters beforehand.
    pub(crate) fn with_priors(&self, free: &[usize], factor: TriangularFactor) -> TriangularFactor {
        let known: Vec<_> = self.prior_rows(free).collect();
        if known.is_empty() {
            return factor;
        }
        let mut rows = Mat::zeros(known.len(), free.len() + 1);
        for (i, (entries, error)) in known.iter().enumerate() {
            entries.iter().for_each(|(j, value)| rows[(i, *j)] += value);
            rows[(i, free.len())] = *error;
        }
        factor.stack(&TriangularFactor::of(&rows))
    }

    /// The step of [`TriangularFactor::solve`] that stays within the bounds of the `free` parameters. `None` if singular.
    ///
    /// An active set: who stands on a bound and is pulled outwards stays; who would go beyond is put on the bound, and the others
    /// take their best step at the same time.
    pub(crate) fn step_within_bounds(
        &self,
        free: &[usize],
        factor: &TriangularFactor,
        damping: f64,
    ) -> Option<Vec<f64>> {
        if self.known.values().all(|known| known.bounds.is_none()) {
            return factor.solve(damping);
        }
        let room: Vec<Option<(f64, f64)>> = free
            .iter()
            .map(|k| {
                self.known(*k)
                    .bounds
                    .map(|bounds| (bounds.low - self.x[*k], bounds.high - self.x[*k]))
            })
            .collect();
        let mut fixed: Vec<Option<f64>> = self
            .pinned(free, factor)
            .into_iter()
            .map(|pinned| pinned.then_some(0.0))
            .collect();
        loop {
            let part = factor.given(&fixed).solve(damping)?;
            let mut others = part.into_iter();
            let step: Vec<f64> = fixed
                .iter()
                .map(|fixed| fixed.or_else(|| others.next()).unwrap_or_default())
                .collect();
            let mut beyond = false;
            for ((fixed, room), change) in fixed.iter_mut().zip(&room).zip(&step) {
                if let (None, Some((low, high))) = (*fixed, room)
                    && (change < low || change > high)
                {
                    *fixed = Some(change.clamp(*low, *high));
                    beyond = true;
                }
            }
            if !beyond {
                return Some(step);
            }
        }
    }

    /// Which of the `free` parameters stand on a bound and would have to go beyond to lower the cost.
    pub(crate) fn pinned(&self, free: &[usize], factor: &TriangularFactor) -> Vec<bool> {
        // The factor's J^T r points downhill: residuals are measured - predicted.
        let downhill = factor.gradient();
        let stands = |(k, down): (&usize, f64)| {
            self.known(*k).bounds.is_some_and(|bounds| {
                (self.x[*k] >= bounds.high && down > 0.0)
                    || (self.x[*k] <= bounds.low && down < 0.0)
            })
        };
        free.iter().zip(downhill).map(stands).collect()
    }
}
