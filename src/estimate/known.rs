//! What is known of a parameter before the recording speaks: a normal prior, bounds, or both.

use super::factor::Factor;
use super::model::Model;
use faer::Mat;

/// Beforehand about one parameter, SI.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    pub prior: Option<Prior>,
    pub bounds: Option<Bounds>,
}

/// A normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    pub mean: f64,
    /// Above zero.
    pub sigma: f64,
}

/// Both ends belong to what is allowed; `low < high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    pub low: f64,
    pub high: f64,
}

/// What a prior and the data say of one parameter, after a fit with both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opinion {
    pub prior: Prior,
    /// Estimate and standard deviation without this prior, SI; `None` where the data alone say nothing.
    pub without: Option<(f64, f64)>,
    /// Distance of the two in standard deviations of their difference.
    pub conflict: f64,
}

/// A prior and data farther apart than this many standard deviations contradict each other.
pub const CONFLICT: f64 = 3.0;

impl Opinion {
    /// From the estimate and its variance with the prior: the prior's information taken off again.
    pub(crate) fn of(prior: Prior, estimate: f64, variance: f64) -> Self {
        let (own, off) = (prior.sigma * prior.sigma, estimate - prior.mean);
        let rest = own - variance;
        // The data's share of the information is rest / own: smaller, it is rounding.
        if rest <= 1e-6 * own {
            return Self { prior, without: None, conflict: 0.0 };
        }
        let without = (prior.mean + off * own / rest, (variance * own / rest).sqrt());
        Self { prior, without: Some(without), conflict: off.abs() / rest.sqrt() }
    }
}

impl Model {
    /// Where a parameter stands that nothing estimates: its prior's mean or nominal, within its bounds.
    pub(crate) fn rest(&self, parameter: usize) -> f64 {
        let known = self.known(parameter);
        self.within(parameter, known.prior.map_or(0.0, |prior| prior.mean))
    }

    /// The nearest allowed value.
    pub(crate) fn within(&self, parameter: usize, value: f64) -> f64 {
        self.known(parameter).bounds.map_or(value, |bounds| value.clamp(bounds.low, bounds.high))
    }

    pub(crate) fn known(&self, parameter: usize) -> Known {
        self.known.get(&parameter).copied().unwrap_or_default()
    }

    /// The factor with a row for every prior of the `free` parameters, and what the priors add to the cost.
    pub(crate) fn with_priors(&self, free: &[usize], factor: Factor) -> (Factor, f64) {
        let priors: Vec<(usize, f64, f64)> = free
            .iter()
            .enumerate()
            .filter_map(|(j, k)| self.known(*k).prior.map(|prior| (j, prior.sigma, (prior.mean - self.x[*k]) / prior.sigma)))
            .collect();
        if priors.is_empty() {
            return (factor, 0.0);
        }
        let mut rows = Mat::zeros(priors.len(), free.len() + 1);
        for (i, (j, sigma, off)) in priors.iter().enumerate() {
            rows[(i, *j)] = 1.0 / sigma;
            rows[(i, free.len())] = *off;
        }
        let cost = priors.iter().map(|(_, _, off)| 0.5 * off * off).sum();
        (factor.stack(&Factor::of(&rows)), cost)
    }

    /// The step of [`Factor::solve`] that stays within the bounds of the `free` parameters. `None` if singular.
    ///
    /// An active set: who stands on a bound and is pulled outwards stays; who would go beyond is put on the bound, and the others
    /// take their best step beside.
    pub(crate) fn step_within_bounds(&self, free: &[usize], factor: &Factor, damping: f64) -> Option<Vec<f64>> {
        if self.known.values().all(|known| known.bounds.is_none()) {
            return factor.solve(damping);
        }
        let room: Vec<Option<(f64, f64)>> = free
            .iter()
            .map(|k| self.known(*k).bounds.map(|bounds| (bounds.low - self.x[*k], bounds.high - self.x[*k])))
            .collect();
        let mut fixed: Vec<Option<f64>> = self.pinned(free, factor).into_iter().map(|pinned| pinned.then_some(0.0)).collect();
        loop {
            let part = factor.given(&fixed).solve(damping)?;
            let mut others = part.into_iter();
            let step: Vec<f64> = fixed.iter().map(|fixed| fixed.or_else(|| others.next()).unwrap_or_default()).collect();
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
    pub(crate) fn pinned(&self, free: &[usize], factor: &Factor) -> Vec<bool> {
        // The factor's J^T r points downhill: residuals are measured - predicted.
        let downhill = factor.gradient();
        let stands = |(k, down): (&usize, f64)| {
            self.known(*k)
                .bounds
                .is_some_and(|bounds| (self.x[*k] >= bounds.high && down > 0.0) || (self.x[*k] <= bounds.low && down < 0.0))
        };
        free.iter().zip(downhill).map(stands).collect()
    }
}
