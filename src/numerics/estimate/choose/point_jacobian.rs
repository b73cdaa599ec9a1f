//! What poses would tell: the seen parameters, rows of their whitened Jacobian, and what would follow for the estimate.

use crate::estimate::factor::{RowSums, StackedRows, TriangularFactor};
use crate::estimate::model::Model;
use crate::estimate::observe::{Visibility, visibility};
use crate::estimate::problem::{Problem, columns};
use crate::observation::{ExcessSigma, MeasurementKind, SocketKind};
use crate::robot::Measurements;
use crate::statistics::nearest;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Rows that are factored at once.
const CHUNK: usize = 900;

/// Parameters that are told by candidate poses as a whole, in order of precedence.
#[derive(Debug, Clone)]
pub struct PointJacobian {
    free: Vec<usize>,
    /// The parameters of `free` are in units of these, SI.
    prior: Vec<f64>,
    /// Parameters that are a last column together, each at its size, SI; empty for none.
    sized: Vec<(usize, f64)>,
}

/// What a set of poses promises, before any measurement.
#[derive(Debug, Clone)]
pub struct Score {
    /// How many points of the workspace.
    pub points: usize,
    /// Observability index O1, as after a fit.
    pub o1: f64,
    /// Standard deviation of every seen parameter, SI.
    pub sigma: Vec<f64>,
    /// Length of one sigma of the predicted position over the workspace, m: median, 95th percentile, largest.
    pub median: f64,
    /// 95th percentile, m.
    pub p95: f64,
    /// m.
    pub max: f64,
}

impl PointJacobian {
    /// Which of the parameters in `order` the data would see; the earlier one stays where two do the same.
    pub(super) fn of(model: &Model, data: &Measurements, order: &[usize]) -> Self {
        let rows: Vec<usize> = (0..data.rows()).collect();
        let problem = Problem::new(data, &rows, ExcessSigma::default());
        let factor = problem.observe(model, order).factor;
        let prior = |k: &usize| model.stack.specs()[*k].tolerance;
        let seen = visibility(&factor, &order.iter().map(prior).collect::<Vec<_>>());
        let free: Vec<usize> = order
            .iter()
            .zip(&seen)
            .filter(|(_, v)| **v == Visibility::Seen)
            .map(|(k, _)| *k)
            .collect();
        Self {
            prior: free.iter().map(prior).collect(),
            free,
            sized: Vec::new(),
        }
    }

    /// All parameters in `free`, seen or not; last, as one, what those in `sized` do at these sizes (SI).
    pub(super) fn given(model: &Model, free: Vec<usize>, sized: Vec<(usize, f64)>) -> Self {
        Self {
            prior: free
                .iter()
                .map(|k| model.stack.specs()[*k].tolerance)
                .collect(),
            free,
            sized,
        }
    }

    /// Positions in the stack.
    pub fn free(&self) -> &[usize] {
        &self.free
    }

    /// Three rows a pose: derivatives by the free parameters in units of prior sigma, over the point's sigma. Of a target that a
    /// socket holds they are those of what closes there.
    pub(super) fn rows(&self, model: &Model, data: &Measurements) -> Mat<f64> {
        let count = model.stack.specs().len();
        let (column, mut size) = (columns(model, &self.free), vec![0.0; count]);
        self.sized
            .iter()
            .for_each(|(parameter, part)| size[*parameter] += part);
        let mut scale = self.prior.clone();
        scale.extend((!self.sized.is_empty()).then_some(1.0));
        let p = scale.len();
        let poses: Vec<Vec<Vector3<f64>>> = (0..data.rows())
            .into_par_iter()
            .with_min_len(32)
            .map_init(
                || model.stack.scratch(&model.robot),
                |scratch, row| {
                    let mut line = vec![Vector3::zeros(); p];
                    let add = |parameter: usize, derivative: Vector3<f64>| {
                        if let Some(j) = column[parameter] {
                            line[j] += derivative;
                        }
                        if size[parameter] != 0.0
                            && let Some(sum) = line.last_mut()
                        {
                            *sum += derivative * size[parameter];
                        }
                    };
                    let mut placed = model.place(data, row, scratch);
                    match data.reading(SocketKind.about().name, row) {
                        Some(_) => placed.partials_from_anchor(&Vector3::zeros(), add),
                        None => placed.partials(add),
                    }
                    line
                },
            )
            .collect();
        let closing = |row: usize| {
            data.reading(SocketKind.about().name, row)
                .map(|reading| Vector3::repeat(reading.sigma))
        };
        let sigma: Vec<Vector3<f64>> = (0..data.rows())
            .map(|row| closing(row).unwrap_or(data.points.sigma[row]))
            .collect();
        let mut out = Mat::zeros(3 * data.rows(), p);
        for (j, scale) in scale.iter().enumerate() {
            let column = out.col_as_slice_mut(j);
            for (row, (line, sigma)) in poses.iter().zip(&sigma).enumerate() {
                let derivative = line[j] * *scale;
                column[3 * row] = derivative.x / sigma.x;
                column[3 * row + 1] = derivative.y / sigma.y;
                column[3 * row + 2] = derivative.z / sigma.z;
            }
        }
        out
    }

    /// What measuring `data` would give, with the prediction's uncertainty at the poses of `workspace`.
    pub fn score(&self, model: &Model, data: &Measurements, workspace: &Measurements) -> Score {
        self.score_rows(
            &self.rows(model, data),
            &self.rows(model, workspace),
            workspace,
        )
    }

    /// The same of [`Self::rows`] of the data and of the workspace.
    pub(super) fn score_rows(
        &self,
        rows: &Mat<f64>,
        around: &Mat<f64>,
        workspace: &Measurements,
    ) -> Score {
        let (p, points) = (self.free.len(), rows.nrows() / 3);
        let factor = factor(rows);
        // The singular values' product is that of the diagonal.
        let mean_log = (0..p).map(|j| factor.column(j)[j].abs().ln()).sum::<f64>() / p as f64;
        let o1 = mean_log.exp() / (points as f64).sqrt();
        let Some(inverse) = factor.inverse() else {
            let (sigma, none) = (vec![f64::INFINITY; p], f64::INFINITY);
            return Score {
                points,
                o1,
                sigma,
                median: none,
                p95: none,
                max: none,
            };
        };
        let sigma = (0..p).map(|i| self.prior[i] * inverse.row_norm(i));
        let spread = product(around.as_ref(), inverse.matrix(1.0).as_ref());
        let mut squares = vec![0.0; around.nrows()];
        for j in 0..p {
            for (sum, value) in squares.iter_mut().zip(spread.col_as_slice(j)) {
                *sum += value * value;
            }
        }
        let length = |(squares, sigma): (&[f64], &Vector3<f64>)| {
            norm((0..3).map(|axis| squares[axis].sqrt() * sigma[axis]))
        };
        let mut lengths: Vec<f64> = squares
            .chunks_exact(3)
            .zip(&workspace.points.sigma)
            .map(length)
            .collect();
        let mut at = |share: f64| nearest(&mut lengths, share).unwrap_or(f64::NAN);
        Score {
            points,
            o1,
            sigma: sigma.collect(),
            p95: at(0.95),
            max: at(1.0),
            median: at(0.5),
        }
    }

    /// The log determinant of what [`Self::rows`] leave of the last `count` parameters when all others were fitted, and their
    /// sigmas (SI).
    pub(super) fn remainder(&self, rows: &Mat<f64>, count: usize) -> (f64, Vec<f64>) {
        let p = self.free.len();
        let factor = factor(rows);
        let log = (p - count..p)
            .map(|j| 2.0 * factor.column(j)[j].abs().ln())
            .sum();
        let Some(inverse) = factor.inverse() else {
            return (log, vec![f64::INFINITY; count]);
        };
        (
            log,
            (p - count..p)
                .map(|i| self.prior[i] * inverse.row_norm(i))
                .collect(),
        )
    }
}

/// Rows of chosen poses.
pub(super) fn gather(rows: &Mat<f64>, poses: &[usize]) -> Mat<f64> {
    let mut out = Mat::zeros(3 * poses.len(), rows.ncols());
    for j in 0..rows.ncols() {
        let (from, to) = (rows.col_as_slice(j), out.col_as_slice_mut(j));
        for (i, pose) in poses.iter().enumerate() {
            to[3 * i..3 * i + 3].copy_from_slice(&from[3 * pose..3 * pose + 3]);
        }
    }
    out
}

/// The factor of such rows; the right-hand side is zero.
pub(super) fn factor(rows: &Mat<f64>) -> TriangularFactor {
    let p = rows.ncols();
    let mut tall = StackedRows::new(p + 1, rows.nrows().min(CHUNK));
    for start in (0..rows.nrows()).step_by(CHUNK) {
        let height = CHUNK.min(rows.nrows() - start);
        for (j, column) in tall.chunk(height).into_iter().take(p).enumerate() {
            column.copy_from_slice(&rows.col_as_slice(j)[start..start + height]);
        }
        tall.absorb(height);
    }
    tall.sum()
}

/// The product of two matrices.
pub(super) fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut out = Mat::zeros(a.nrows(), b.ncols());
    matmul(&mut out, Accum::Replace, a, b, 1.0, Par::Seq);
    out
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}
