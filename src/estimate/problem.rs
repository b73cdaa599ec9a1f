//! The calibration problem: weighted residuals of some rows under some free parameters.

use super::factor::{Factor, Tall};
use super::model::Model;
use super::piece::{self, Piece, Rest, Unmodelled, Weight, huber};
use crate::effect::Scratch;
use crate::robot::Measurements;
use faer::Mat;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Rows of the recording that one thread takes at once: fixed, so that sums do not depend on the number of threads.
const SPAN: usize = 4096;
/// Rows whose derivatives are held at once: three lines each of some fifty columns stay in the processor's cache.
const CHUNK: usize = 256;

/// What is fitted to what: residual rows (measured - predicted) / sigma with Huber's weights.
pub(crate) struct Problem<'a> {
    pub data: &'a Measurements,
    /// Rows of the recording to fit.
    pub rows: &'a [usize],
    /// Standard deviations added to the instrument's: what the model does not explain.
    pub unmodelled: Unmodelled,
}

/// The state of a problem at some parameters.
pub(crate) struct Evaluation {
    /// Measured - predicted points (m), in the order of the problem's rows; zero along axes that were not measured.
    pub residuals: Vec<Vector3<f64>>,
    /// What is left of orientations and distances, in that order.
    pub rests: Vec<Rest>,
    /// Sum of Huber's losses and of the priors', dimensionless.
    pub cost: f64,
    /// Root mean square of the residual length of points, or of distances where no point was measured, m.
    pub rms: f64,
    pub factor: Factor,
}

impl Problem<'_> {
    /// Length in standard deviations and number of axes of every piece.
    pub fn errors(&self, residuals: &[Vector3<f64>], rests: &[Rest]) -> Vec<(f64, usize)> {
        let point = |(residual, row): (&Vector3<f64>, &usize)| {
            let length = Weight::of(self.data, *row, self.unmodelled.point).apply(residual).norm();
            Some((length, self.data.axes(*row))).filter(|(_, axes)| *axes > 0)
        };
        let others = rests.iter().map(|rest| (rest.error(self.unmodelled), rest.axes()));
        residuals.iter().zip(self.rows).filter_map(point).chain(others).collect()
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
        let spans: Vec<Span> = self.rows.par_chunks(SPAN).map(|span| self.span(model, span, &column, free.len())).collect();
        let mut residuals = Vec::with_capacity(self.rows.len());
        let mut rests = Vec::new();
        let mut sum: Option<Factor> = None;
        for Span { residuals: some, rests: others, factor } in spans {
            residuals.extend(some);
            rests.extend(others);
            sum = Some(sum.map_or_else(|| factor.clone(), |sum| sum.stack(&factor)));
        }
        let cost = self.errors(&residuals, &rests).into_iter().map(|(error, axes)| huber(error, axes)).sum();
        let rms = self.rms(&residuals, &rests);
        let factor = sum.unwrap_or_else(|| Factor::of(&Mat::zeros(1, free.len() + 1)));
        Evaluation { residuals, rests, cost, rms, factor }
    }

    fn rms(&self, residuals: &[Vector3<f64>], rests: &[Rest]) -> f64 {
        let points = self.rows.iter().filter(|row| self.data.axes(**row) > 0).count();
        let mean = |squares: f64, count: usize| (squares / count.max(1) as f64).sqrt();
        if points > 0 {
            return mean(residuals.iter().map(Vector3::norm_squared).sum(), points);
        }
        let distances: Vec<f64> = rests.iter().filter(|rest| !rest.turn).map(|rest| rest.residual.norm_squared()).collect();
        mean(distances.iter().sum(), distances.len())
    }

    /// Residuals and factor of some rows, in memory of a chunk.
    fn span(&self, model: &Model, rows: &[usize], column: &[Option<usize>], p: usize) -> Span {
        let mut scratch = model.stack.scratch(&model.robot);
        let extra = usize::from(self.data.turn.is_some()) + usize::from(self.data.distance.is_some());
        let mut tall = Tall::new(p + 1, 3 * (1 + extra) * rows.len().min(CHUNK));
        let mut residuals = Vec::with_capacity(rows.len());
        let mut rests = Vec::new();
        for chunk in rows.chunks(CHUNK) {
            let height = 3 * (1 + extra) * chunk.len();
            let mut lines = tall.chunk(height);
            let mut write = |first: usize, piece: Piece, point: &Vector3<f64>, scratch: &mut Scratch| {
                let share = piece.share();
                piece.derivatives(model, point, scratch, |parameter, derivative| {
                    if let Some(j) = column[parameter] {
                        let derivative = derivative * share;
                        add(&mut lines[j][first..first + 3], &derivative);
                    }
                });
                add(&mut lines[p][first..first + 3], &(piece.error * share));
            };
            for (i, &row) in chunk.iter().enumerate() {
                let first = 3 * (1 + extra) * i;
                let point = model.stack.point(&model.robot, self.data, row, &model.x, &mut scratch);
                let residual = self.data.residual(row, &point);
                if let Some(piece) = piece::point(self.data, row, &residual, self.unmodelled) {
                    write(first, piece, &point, &mut scratch);
                }
                residuals.push(residual);
                if extra == 0 {
                    continue;
                }
                if let Some(rest) = piece::turn(model, self.data, row, &scratch) {
                    write(first + 3, Piece::of_turn(&rest, self.unmodelled), &point, &mut scratch);
                    rests.push(rest);
                }
                if let Some((rest, along)) = piece::distance(model, self.data, row, &point, &scratch) {
                    write(first + 3 * extra, Piece::of_distance(&rest, &along, self.unmodelled), &point, &mut scratch);
                    rests.push(rest);
                }
            }
            tall.absorb(height);
        }
        Span { residuals, rests, factor: tall.factor() }
    }
}

fn add(to: &mut [f64], value: &Vector3<f64>) {
    to[0] += value.x;
    to[1] += value.y;
    to[2] += value.z;
}

/// What a thread makes of its rows.
struct Span {
    residuals: Vec<Vector3<f64>>,
    rests: Vec<Rest>,
    factor: Factor,
}
