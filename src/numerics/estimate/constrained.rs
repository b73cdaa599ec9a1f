//! A model's step with what is known beforehand: priors as rows of the factor, bounds by an active set.

use super::factor::TriangularFactor;
use super::length::LengthTerm;
use super::model::{Known, Model};
use faer::Mat;

impl Model {
    /// Where a parameter stands that nothing estimates: its prior's mean or nominal, within its bounds.
    pub(crate) fn prior_value(&self, parameter: usize) -> f64 {
        let known = self.known(parameter);
        self.within(parameter, known.prior.map_or(0.0, |prior| prior.mean))
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

    /// The factor with a row for every prior of the `free` parameters and for every known length, and what these add to the cost.
    pub(crate) fn with_priors(
        &self,
        free: &[usize],
        factor: TriangularFactor,
    ) -> (TriangularFactor, f64) {
        let priors: Vec<(usize, f64, f64)> = free
            .iter()
            .enumerate()
            .filter_map(|(j, k)| {
                self.known(*k)
                    .prior
                    .map(|prior| (j, prior.sigma, (prior.mean - self.x[*k]) / prior.sigma))
            })
            .collect();
        let lengths: Vec<LengthTerm> = self.length_terms().collect();
        if priors.is_empty() && lengths.is_empty() {
            return (factor, 0.0);
        }
        let mut rows = Mat::zeros(priors.len() + lengths.len(), free.len() + 1);
        for (i, term) in lengths.iter().enumerate() {
            for (parameter, rate) in &term.rates {
                free.iter()
                    .position(|k| k == parameter)
                    .into_iter()
                    .for_each(|j| rows[(priors.len() + i, j)] += rate);
            }
            rows[(priors.len() + i, free.len())] = term.error;
        }
        for (i, (j, sigma, off)) in priors.iter().enumerate() {
            rows[(i, *j)] = 1.0 / sigma;
            rows[(i, free.len())] = *off;
        }
        let squares = priors
            .iter()
            .map(|(_, _, off)| off * off)
            .chain(lengths.iter().map(|term| term.error * term.error));
        let cost = squares.map(|square| 0.5 * square).sum();
        (factor.stack(&TriangularFactor::of(&rows)), cost)
    }

    /// The step of [`TriangularFactor::solve`] that stays within the bounds of the `free` parameters. `None` if singular.
    ///
    /// An active set: who stands on a bound and is pulled outwards stays; who would go beyond is put on the bound, and the others
    /// take their best step beside.
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
