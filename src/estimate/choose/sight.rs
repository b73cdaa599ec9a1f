//! What poses would tell: the seen parameters, rows of their whitened Jacobian, and what would follow for the estimate.

use super::median;
use crate::estimate::factor::Factor;
use crate::estimate::model::Model;
use crate::estimate::observe::{Visibility, indices, visibility};
use crate::estimate::piece::Unmodelled;
use crate::estimate::problem::Problem;
use crate::robot::Measurements;
use faer::Mat;
use rayon::prelude::*;

/// Parameters that are told by candidate poses as a whole, in order of precedence.
#[derive(Debug, Clone)]
pub struct Sight {
    free: Vec<usize>,
    /// The parameters of `free` are in units of these, SI.
    prior: Vec<f64>,
}

/// What a set of poses promises, before any measurement.
#[derive(Debug, Clone)]
pub struct Score {
    pub points: usize,
    /// Observability index O1, as after a fit.
    pub o1: f64,
    /// Standard deviation of every seen parameter, SI.
    pub sigma: Vec<f64>,
    /// Length of one sigma of the predicted position over the workspace, m: median, 95th percentile, largest.
    pub median: f64,
    pub p95: f64,
    pub max: f64,
}

impl Sight {
    /// Which of the parameters in `order` the data would see; the earlier one stays where two do the same.
    pub(super) fn of(model: &Model, data: &Measurements, order: &[usize]) -> Self {
        let rows: Vec<usize> = (0..data.rows()).collect();
        let factor = Problem { data, rows: &rows, unmodelled: Unmodelled::default() }.evaluate(model, order).factor;
        let prior = |k: &usize| model.stack.specs()[*k].prior_sigma;
        let seen = visibility(&factor, &order.iter().map(prior).collect::<Vec<_>>());
        let free: Vec<usize> = order.iter().zip(&seen).filter(|(_, v)| **v == Visibility::Seen).map(|(k, _)| *k).collect();
        Self { prior: free.iter().map(prior).collect(), free }
    }

    /// Positions in the stack.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// Three rows a pose, row-major: derivatives by the free parameters in units of prior sigma, over the point's sigma.
    pub(super) fn rows(&self, model: &Model, data: &Measurements) -> Vec<f64> {
        let p = self.free.len();
        let mut column = vec![usize::MAX; model.stack.specs().len()];
        for (j, parameter) in self.free.iter().enumerate() {
            column[*parameter] = j;
        }
        let mut out = vec![0.0; 3 * p * data.rows()];
        out.par_chunks_mut((3 * p).max(1)).enumerate().with_min_len(32).for_each_init(
            || model.stack.scratch(&model.robot),
            |scratch, (row, block)| {
                model.stack.derivatives(&model.robot, data, row, &model.x, scratch, |parameter, derivative| {
                    let j = column[parameter];
                    if j != usize::MAX {
                        for axis in 0..3 {
                            block[axis * p + j] += derivative[axis] * self.prior[j] / data.sigma[row][axis];
                        }
                    }
                });
            },
        );
        out
    }

    /// The factor of these rows; the right-hand side is zero.
    pub(super) fn factor(&self, model: &Model, data: &Measurements) -> Factor {
        let p = self.free.len();
        let rows = self.rows(model, data);
        // Chunks keep the memory small for many candidates.
        let factors = rows.chunks((300 * p).max(1)).map(|chunk| {
            Factor::of(&Mat::from_fn(chunk.len() / p.max(1), p + 1, |i, j| if j < p { chunk[i * p + j] } else { 0.0 }))
        });
        factors.reduce(|sum, factor| sum.stack(&factor)).unwrap_or_else(|| Factor::of(&Mat::zeros(1, p + 1)))
    }

    /// What measuring `data` would give, with the prediction's uncertainty at the poses of `workspace`.
    pub fn score(&self, model: &Model, data: &Measurements, workspace: &Measurements) -> Score {
        let p = self.free.len();
        let factor = self.factor(model, data);
        let singular = factor.singular_values(&vec![1.0; p]);
        let o1 = indices(&singular, data.rows()).into_iter().find(|(name, ..)| *name == "O1").map_or(0.0, |(_, value, _)| value);
        let Some(inverse) = factor.inverse() else {
            let (sigma, none) = (vec![f64::INFINITY; p], f64::INFINITY);
            return Score { points: data.rows(), o1, sigma, median: none, p95: none, max: none };
        };
        let sigma = (0..p).map(|i| self.prior[i] * norm((i..p).map(|j| inverse[(i, j)])));
        let rows = self.rows(model, workspace);
        let mut lengths: Vec<f64> = (0..workspace.rows())
            .map(|row| {
                let parts = (0..3).map(|axis| {
                    let derivative = &rows[(3 * row + axis) * p..(3 * row + axis + 1) * p];
                    let along = |j: usize| (0..=j).map(|i| derivative[i] * inverse[(i, j)]).sum::<f64>();
                    norm((0..p).map(along)) * workspace.sigma[row][axis]
                });
                norm(parts)
            })
            .collect();
        lengths.sort_by(f64::total_cmp);
        let at = |share: f64| lengths.get((share * (lengths.len() - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN);
        Score { points: data.rows(), o1, sigma: sigma.collect(), p95: at(0.95), max: at(1.0), median: median(lengths) }
    }

    /// Log determinant of what is left of the last `count` parameters when all others were fitted, and their sigmas (SI).
    pub(super) fn remainder(&self, model: &Model, data: &Measurements, count: usize) -> (f64, Vec<f64>) {
        let p = self.free.len();
        let factor = self.factor(model, data);
        let diagonal = |j: usize| factor.column(j).get(j).map_or(0.0, |value| value.abs());
        let log = (p - count..p).map(|j| 2.0 * diagonal(j).ln()).sum();
        let Some(inverse) = factor.inverse() else { return (log, vec![f64::INFINITY; count]) };
        (log, (p - count..p).map(|i| self.prior[i] * norm((i..p).map(|j| inverse[(i, j)]))).collect())
    }
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}
