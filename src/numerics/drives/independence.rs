//! How many rows count: what noise and unmodelled physics leave lasts from row to row, and a model that lacks a cause must not take the
//! cause's own residual for lasting noise. That correlation is estimated from the residual of a rich model: all causes at once, linear, as much
//! as they help in rows that it was not fitted to.

use crate::problem::Drives;
use nalgebra::{DMatrix, DVector};

/// Rows that are looked at, at most.
const MOST: usize = 1600;
/// s of a block of rows that lies in one half.
const BLOCK: f64 = 0.5;
const LEAST_ROWS: usize = 16;
/// Prices of a column's size that are tried, as shares of its rows.
const RIDGES: [f64; 5] = [1e-6, 1e-4, 1e-2, 1.0, 1e9];
/// Share of a column's largest effect, squared, at a joint where it is used.
const HERE: f64 = 0.1;

/// Rows with all columns.
pub(crate) struct Rich {
    /// Number of the sample of each row, if it is one, and each sample's row and block.
    place: Vec<Option<usize>>,
    samples: Vec<(usize, usize)>,
    joints: usize,
    columns: usize,
    /// Whitened, `samples x joints x columns`.
    values: Vec<f64>,
    residual: Vec<f64>,
}

/// Share of rows that are independent where neighbours are so correlated.
pub(crate) fn independent(correlation: f64) -> f64 {
    let correlation = correlation.clamp(0.0, 0.998);
    (1.0 - correlation) / (1.0 + correlation)
}

impl Rich {
    pub(crate) fn new(drives: &Drives, columns: usize) -> Self {
        let recording = &drives.recording;
        let joints = recording.joints();
        let length = ((BLOCK / recording.period) as usize).max(LEAST_ROWS);
        let mut blocks: Vec<std::ops::Range<usize>> = Vec::new();
        for trajectory in &recording.trajectories {
            let mut from = trajectory.rows.start;
            for row in trajectory.rows.clone() {
                if recording.held_out[row] {
                    from = row + 1;
                } else if row + 1 - from == length {
                    blocks.push(from..row + 1);
                    from = row + 1;
                }
            }
        }
        let most = (MOST / length).max(2);
        let every = blocks.len().div_ceil(most).max(1);
        let mut place = vec![None; recording.rows()];
        let mut samples = Vec::new();
        for (block, rows) in blocks.into_iter().step_by(every).enumerate() {
            for row in rows {
                place[row] = Some(samples.len());
                samples.push((row, block));
            }
        }
        let count = samples.len() * joints;
        Self {
            place,
            samples,
            joints,
            columns,
            values: vec![0.0; count * columns],
            residual: vec![0.0; count],
        }
    }

    /// A row of a joint, whitened.
    pub(crate) fn add(
        &mut self,
        row: usize,
        joint: usize,
        residual: f64,
        columns: impl Iterator<Item = f64>,
    ) {
        let Some(sample) = self.place[row] else {
            return;
        };
        let at = sample * self.joints + joint;
        self.residual[at] = residual;
        let values = &mut self.values[at * self.columns..(at + 1) * self.columns];
        for (to, from) in values.iter_mut().zip(columns) {
            *to = if from.is_finite() { from } else { 0.0 };
        }
    }

    /// Share of rows that are independent given the rich model.
    pub(crate) fn independence(&self) -> f64 {
        if self.samples.last().is_none_or(|(_, block)| *block < 1) {
            return 0.0;
        }
        let size = |joint: usize, column: usize| -> f64 {
            let of = |sample: usize| {
                self.values[(sample * self.joints + joint) * self.columns + column].powi(2)
            };
            (0..self.samples.len()).map(of).sum()
        };
        let sizes: Vec<Vec<f64>> = (0..self.joints)
            .map(|joint| {
                (0..self.columns)
                    .map(|column| size(joint, column))
                    .collect()
            })
            .collect();
        let (mut own, mut next) = (0.0, 0.0);
        for joint in 0..self.joints {
            let used: Vec<usize> = (0..self.columns)
                .filter(|column| {
                    let most = sizes.iter().map(|sizes| sizes[*column]).fold(0.0, f64::max);
                    sizes[joint][*column] > HERE * most
                })
                .collect();
            let residuals = self.residual(joint, &used, &sizes[joint]);
            for (k, (row, block)) in self.samples.iter().enumerate() {
                own += residuals[k] * residuals[k];
                if k > 0 && self.samples[k - 1] == (row - 1, *block) {
                    next += residuals[k] * residuals[k - 1];
                }
            }
        }
        if own > 0.0 {
            independent(next / own)
        } else {
            1.0
        }
    }

    /// Residual at a joint by the best price, each half of the blocks predicted from the other half.
    fn residual(&self, joint: usize, used: &[usize], sizes: &[f64]) -> Vec<f64> {
        let rows = self.samples.len() as f64;
        let scale: Vec<f64> = used
            .iter()
            .map(|column| (sizes[*column] / rows).sqrt().recip())
            .collect();
        let values = |sample: usize| {
            let at = (sample * self.joints + joint) * self.columns;
            used.iter()
                .zip(&scale)
                .map(move |(column, scale)| self.values[at + column] * scale)
        };
        let residual = |sample: usize| self.residual[sample * self.joints + joint];
        let halves = [0, 1].map(|half| {
            let of: Vec<usize> = (0..self.samples.len())
                .filter(|sample| self.samples[*sample].1 % 2 == half)
                .collect();
            let mut matrix = DMatrix::zeros(of.len(), used.len());
            for (k, sample) in of.iter().enumerate() {
                for (c, value) in values(*sample).enumerate() {
                    matrix[(k, c)] = value;
                }
            }
            let right = DVector::from_iterator(of.len(), of.iter().map(|k| residual(*k)));
            (of, matrix, right)
        });
        let sums = halves
            .each_ref()
            .map(|(_, matrix, right)| (matrix.tr_mul(matrix), matrix.tr_mul(right)));
        let of_ridge = |ridge: &f64| {
            let mut residuals = vec![0.0; self.samples.len()];
            for (half, (of, matrix, right)) in halves.iter().enumerate() {
                let (gram, gradient) = &sums[1 - half];
                let price = ridge * halves[1 - half].0.len() as f64;
                let whole = gram + DMatrix::identity(used.len(), used.len()) * price;
                let Some(factor) = whole.cholesky() else {
                    return (f64::INFINITY, residuals);
                };
                let remains = right - matrix * factor.solve(gradient);
                for (sample, value) in of.iter().zip(remains.iter()) {
                    residuals[*sample] = *value;
                }
            }
            (residuals.iter().map(|x| x * x).sum::<f64>(), residuals)
        };
        let all = RIDGES.iter().map(of_ridge);
        let best = all.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or_else(Vec::new, |(_, residuals)| residuals)
    }
}
