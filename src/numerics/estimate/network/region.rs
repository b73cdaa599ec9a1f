//! What a correction is learnt from, and where it is valid: the range of every source that it saw, and of all joints together.
//!
//! Outside it fades by the smoothstep `s^2 (3 - 2 s)`, `s = 1 - distance/margin`, per source and for Mahalanobis' distance of the
//! joints, all multiplied: nothing is left one margin beyond any of them.

use super::perceptron::OUTPUTS;
use crate::robot::pose_groups::{NEAR, grouped};
use nalgebra::DMatrix;

/// The margin as a share of the range that was seen.
const MARGIN: f64 = 0.1;
/// The margin where a joint hardly moved, rad or m.
const LEAST_MARGIN: f64 = 0.01;

/// Rows to learn from: sources (joints, payload) and the residual to be explained, m.
#[derive(Debug, Clone, Default)]
pub struct TrainingSamples {
    /// Inputs of each row: joints (rad or m), then payload (kg).
    pub sources: Vec<Vec<f64>>,
    /// Measured minus predicted of each row, m.
    pub residual: Vec<[f64; OUTPUTS]>,
}

impl TrainingSamples {
    /// How many rows.
    pub fn rows(&self) -> usize {
        self.residual.len()
    }
    /// The pose of each row, numbered in the order of their first rows: several targets measured in one pose share it.
    pub fn poses(&self) -> Vec<usize> {
        let rows: Vec<usize> = (0..self.rows()).collect();
        let mut number = vec![0; self.rows()];
        // A payload (kg) as near as joints (rad, m) are is the same one.
        let poses = grouped(&rows, |row| &self.sources[row], NEAR, |_, _| true);
        for (pose, rows) in poses.iter().enumerate() {
            rows.iter().for_each(|row| number[*row] = pose);
        }
        number
    }

    /// Some of the rows.
    pub fn pick(&self, rows: &[usize]) -> Self {
        Self {
            sources: rows.iter().map(|r| self.sources[*r].clone()).collect(),
            residual: rows.iter().map(|r| self.residual[*r]).collect(),
        }
    }
}

/// The range of a source that the training saw, and how far beyond it the correction is gone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Valid {
    /// Lowest training value.
    pub lower: f64,
    /// Highest training value.
    pub upper: f64,
    /// Over which the correction fades out beyond.
    pub margin: f64,
}

impl Valid {
    /// The range of a joint's positions, rad or m.
    pub(crate) fn joint(values: impl Iterator<Item = f64> + Clone) -> Self {
        Self::of(values, |_| LEAST_MARGIN)
    }
    /// The range of a payload, kg: what a load does is proportional to it, so a tenth of the load is as near as a tenth of the range.
    pub(crate) fn payload(values: impl Iterator<Item = f64> + Clone) -> Self {
        Self::of(values, |heaviest| MARGIN * heaviest.max(1.0))
    }
    fn of(values: impl Iterator<Item = f64> + Clone, least: impl Fn(f64) -> f64) -> Self {
        let lower = values.clone().fold(f64::INFINITY, f64::min);
        let upper = values.fold(f64::NEG_INFINITY, f64::max);
        Self {
            lower,
            upper,
            margin: (MARGIN * (upper - lower)).max(least(upper)),
        }
    }
    /// 1 inside, 0 from one margin outside on.
    fn share(&self, value: f64) -> f64 {
        fade((self.lower - value).max(value - self.upper), self.margin)
    }
}

/// All joints together: Mahalanobis' distance `|F (q - mean)|` of the farthest posture that was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Jointly {
    /// Mean of the training rows.
    pub mean: Vec<f64>,
    /// Lower triangle of `F`, row by row.
    pub factor: Vec<Vec<f64>>,
    /// Distance of the farthest posture.
    pub limit: f64,
    /// Over which the correction fades out beyond.
    pub margin: f64,
}

impl Jointly {
    fn of(postures: &[&[f64]]) -> Option<Self> {
        let joints = postures.first()?.len();
        let count = postures.len() as f64;
        let mean: Vec<f64> = (0..joints)
            .map(|j| postures.iter().map(|q| q[j]).sum::<f64>() / count)
            .collect();
        let product = |i: usize, j: usize| {
            postures
                .iter()
                .map(|q| (q[i] - mean[i]) * (q[j] - mean[j]))
                .sum::<f64>()
                / count
        };
        // A joint that hardly moved still has its least margin.
        let covariance = DMatrix::from_fn(joints, joints, |i, j| {
            product(i, j)
                + if i == j {
                    LEAST_MARGIN * LEAST_MARGIN
                } else {
                    0.0
                }
        });
        let factor = covariance
            .cholesky()?
            .l()
            .solve_lower_triangular(&DMatrix::identity(joints, joints))?;
        let factor = (0..joints)
            .map(|i| (0..=i).map(|j| factor[(i, j)]).collect())
            .collect();
        let mut region = Self {
            mean,
            factor,
            limit: 0.0,
            margin: 0.0,
        };
        region.limit = postures
            .iter()
            .map(|q| region.distance(q))
            .fold(0.0, f64::max);
        region.margin = MARGIN * region.limit.max(1.0);
        Some(region)
    }

    fn distance(&self, q: &[f64]) -> f64 {
        let off = |j: usize| q[j] - self.mean[j];
        let along = |row: &Vec<f64>| row.iter().enumerate().map(|(j, f)| f * off(j)).sum::<f64>();
        self.factor
            .iter()
            .map(|row| along(row).powi(2))
            .sum::<f64>()
            .sqrt()
    }
}

/// The region that a correction saw.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// By source: the joints, and the payload where it was known in training, be it an input or not.
    pub ranges: Vec<Valid>,
    /// The region of all inputs together, where there are enough rows.
    pub jointly: Option<Jointly>,
}

impl Region {
    /// The region of rows of sources, the first `joints` of them joints (rad or m), then the payload (kg).
    pub fn of(sources: &[Vec<f64>], joints: usize) -> Self {
        let width = sources.first().map_or(0, Vec::len);
        let column = |s: usize| sources.iter().map(move |row| row[s]);
        let ranges = (0..width)
            .map(|s| {
                if s < joints {
                    Valid::joint(column(s))
                } else {
                    Valid::payload(column(s))
                }
            })
            .collect();
        let postures: Vec<&[f64]> = sources.iter().filter_map(|row| row.get(..joints)).collect();
        Self {
            ranges,
            jointly: Jointly::of(&postures),
        }
    }

    /// 1 inside, 0 where nothing is known, between on the margin. A source that is missing or no number is outside.
    pub(crate) fn share(&self, sources: &[f64]) -> f64 {
        let count = self.ranges.len();
        if sources.len() < count || sources.iter().take(count).any(|v| !v.is_finite()) {
            return 0.0;
        }
        let each: f64 = self
            .ranges
            .iter()
            .zip(sources)
            .map(|(valid, value)| valid.share(*value))
            .product();
        each * self.jointly.as_ref().map_or(1.0, |all| {
            fade(all.distance(sources) - all.limit, all.margin)
        })
    }

    /// The nearest sources within the ranges.
    pub(crate) fn held(&self, sources: &[f64]) -> Vec<f64> {
        self.ranges
            .iter()
            .zip(sources)
            .map(|(valid, value)| value.clamp(valid.lower, valid.upper))
            .collect()
    }
}

fn fade(outside: f64, margin: f64) -> f64 {
    let s = (1.0 - outside.max(0.0) / margin).max(0.0);
    s * s * (3.0 - 2.0 * s)
}
