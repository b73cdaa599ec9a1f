//! The calibration problem: weighted position residuals of some rows under some free parameters.

use super::factor::{Factor, Tall};
use super::model::Model;
use crate::robot::Measurements;
use faer::Mat;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

/// Rows of the recording that one thread takes at once: fixed, so that sums do not depend on the number of threads.
const SPAN: usize = 4096;
/// Rows whose derivatives are held at once: three lines each of some fifty columns stay in the processor's cache.
const CHUNK: usize = 256;

/// Beyond this whitened error length (three axes, one sigma each: 99.3 % of good rows are below) a row pulls with constant force.
pub(crate) const HUBER: f64 = 3.5;

/// What is fitted to what: residual rows (measured - predicted) / sigma with Huber's weights.
pub(crate) struct Problem<'a> {
    pub data: &'a Measurements,
    /// Rows of the recording to fit.
    pub rows: &'a [usize],
    /// Standard deviation per axis added to the instrument's, m: what the model does not explain.
    pub unmodelled: f64,
}

/// The state of a problem at some parameters.
pub(crate) struct Evaluation {
    /// Measured - predicted (m), in the order of the problem's rows.
    pub residuals: Vec<Vector3<f64>>,
    /// Sum of Huber's losses and of the priors', dimensionless.
    pub cost: f64,
    /// Root mean square of the residual length, m.
    pub rms: f64,
    pub factor: Factor,
}

/// Turns a row's errors into standard deviations.
#[derive(Clone, Copy)]
pub(crate) enum Weight {
    /// Inverse standard deviation per axis.
    Axes(Vector3<f64>),
    /// Inverse of the covariance's Cholesky factor.
    Full(Matrix3<f64>),
}

impl Weight {
    /// Of a row with `unmodelled` (m per axis) beside its own noise.
    pub fn of(data: &Measurements, row: usize, unmodelled: f64) -> Self {
        let variance = data.sigma[row].map(|sigma| sigma * sigma + unmodelled * unmodelled);
        let full = data.spread.as_ref().map(|all| all[row] + Matrix3::from_diagonal(&variance));
        match full.and_then(|covariance| covariance.cholesky()).and_then(|factor| factor.l().try_inverse()) {
            Some(inverse) => Self::Full(inverse),
            None => Self::Axes(variance.map(|value| 1.0 / value.sqrt())),
        }
    }

    /// m (or m per unit) -> standard deviations.
    pub fn apply(&self, error: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Axes(weight) => error.component_mul(weight),
            Self::Full(inverse) => inverse * error,
        }
    }
}

impl Problem<'_> {
    /// The whitened error length of every residual.
    pub fn errors(&self, residuals: &[Vector3<f64>]) -> Vec<f64> {
        let one = |(residual, row): (&Vector3<f64>, &usize)| Weight::of(self.data, *row, self.unmodelled).apply(residual).norm();
        residuals.iter().zip(self.rows).map(one).collect()
    }

    /// The problem at the model's parameters, linearised in the `free` ones, with what is known of them beforehand.
    pub fn evaluate(&self, model: &Model, free: &[usize]) -> Evaluation {
        let data = self.observe(model, free);
        let (factor, cost) = model.with_priors(free, data.factor);
        Evaluation { factor, cost: data.cost + cost, ..data }
    }

    /// The same from the data alone.
    pub fn observe(&self, model: &Model, free: &[usize]) -> Evaluation {
        let mut column = vec![None; model.stack.specs().len()];
        for (j, parameter) in free.iter().enumerate() {
            column[*parameter] = Some(j);
        }
        let spans: Vec<(Vec<Vector3<f64>>, Factor)> =
            self.rows.par_chunks(SPAN).map(|span| self.span(model, span, &column, free.len())).collect();
        let mut residuals = Vec::with_capacity(self.rows.len());
        let mut sum: Option<Factor> = None;
        for (some, factor) in spans {
            residuals.extend(some);
            sum = Some(sum.map_or_else(|| factor.clone(), |sum| sum.stack(&factor)));
        }
        let cost = self.errors(&residuals).into_iter().map(huber).sum();
        let squares: f64 = residuals.iter().map(Vector3::norm_squared).sum();
        let rms = (squares / residuals.len().max(1) as f64).sqrt();
        let factor = sum.unwrap_or_else(|| Factor::of(&Mat::zeros(1, free.len() + 1)));
        Evaluation { residuals, cost, rms, factor }
    }

    /// Residuals and factor of some rows, in memory of a chunk.
    fn span(&self, model: &Model, rows: &[usize], column: &[Option<usize>], p: usize) -> (Vec<Vector3<f64>>, Factor) {
        let mut scratch = model.stack.scratch(&model.robot);
        let mut tall = Tall::new(p + 1, 3 * rows.len().min(CHUNK));
        let mut residuals = Vec::with_capacity(rows.len());
        for chunk in rows.chunks(CHUNK) {
            let mut lines = tall.chunk(3 * chunk.len());
            for (i, &row) in chunk.iter().enumerate() {
                let point = model.stack.point(&model.robot, self.data, row, &model.x, &mut scratch);
                let residual = self.data.position[row] - point;
                let weight = Weight::of(self.data, row, self.unmodelled);
                let whitened = weight.apply(&residual);
                let error = whitened.norm();
                let share = if error > HUBER { (HUBER / error).sqrt() } else { 1.0 };
                model.stack.partials(&model.robot, &point, &mut scratch, |parameter, derivative| {
                    if let Some(j) = column[parameter] {
                        let derivative = weight.apply(&derivative) * share;
                        for axis in 0..3 {
                            lines[(3 * i + axis, j)] += derivative[axis];
                        }
                    }
                });
                for axis in 0..3 {
                    lines[(3 * i + axis, p)] = whitened[axis] * share;
                }
                residuals.push(residual);
            }
            tall.absorb(3 * chunk.len());
        }
        (residuals, tall.factor())
    }
}

fn huber(error: f64) -> f64 {
    if error <= HUBER { 0.5 * error * error } else { HUBER * (error - 0.5 * HUBER) }
}
