//! Motor currents as a second witness of the torque model: holding torque minus what the model says hangs there.

use crate::criteria::noise::CURRENTS;
use crate::effect::PointMotion;
use crate::estimate::Prior;
use crate::robot::{Measurements, RobotModel};
use crate::statistics::nearest;
use nalgebra::{DMatrix, DVector};

/// The motors whose currents are usable.
pub(crate) struct Currents {
    /// Joints, from 0.
    pub(crate) joints: Vec<usize>,
    /// Nm for each residual row: rows of the recording x joints, row by row.
    residual: Vec<f64>,
    /// Standard deviation of each joint's residuals, Nm.
    sigma: Vec<f64>,
    /// Direction of approach in each residual row.
    direction: Vec<f64>,
}

/// A motor follows the model if its torque per modelled torque is within these.
const FOLLOWS: std::ops::Range<f64> = 0.6..1.6;

impl Currents {
    /// The usable motors at `rows` seen as `motions`; `None` where no current is usable.
    pub(crate) fn new(
        robot: &RobotModel,
        data: &Measurements,
        rows: &[usize],
        motions: &[PointMotion],
    ) -> Option<Self> {
        let mut usable: Vec<(usize, Vec<f64>, f64)> = Vec::new();
        for joint in (0..robot.joints()).filter(|joint| robot.is_revolute(*joint)) {
            let described = &robot.description().joints[joint];
            let (Some(ratio), Some(constant)) =
                (described.reduction_ratio, described.motor_constant)
            else {
                continue;
            };
            let current: Option<Vec<f64>> = rows
                .iter()
                .map(|row| Some(data.current(*row)?[joint]))
                .collect();
            let Some(current) = current.filter(|all| all.iter().all(|value| value.is_finite()))
            else {
                continue;
            };
            let torque: Vec<f64> = motions
                .iter()
                .map(|motion| motion.posture.torque[joint])
                .collect();
            let most = torque.iter().fold(0.0, |most: f64, t| most.max(t.abs()));
            if most < 1e-6 {
                continue;
            }
            let held: Vec<f64> = current.iter().map(|i| i * ratio * constant).collect();
            // What the motor holds against the load is minus it, or plus it where the controller counts the other way.
            let features = DMatrix::from_fn(rows.len(), 6, |i, k| {
                let (sine, cosine) = libm::sincos(data.q(rows[i])[joint]);
                [
                    torque[i],
                    1.0,
                    data.direction(rows[i], joint),
                    sine,
                    cosine,
                    torque[i] * f64::from(data.payload[rows[i]] > 0.0),
                ][k]
            });
            // A balancer takes its share off the slope, unless torques by the joint's own angle are left to it.
            let slopes = [3, 5].into_iter().filter_map(|count| {
                Some(solve(&features.columns(0, count).into_owned(), &held)?[0])
            });
            let mut slopes = slopes.filter(|slope| FOLLOWS.contains(&slope.abs()));
            let Some(slope) = slopes.next() else {
                continue;
            };
            let Some(all) = solve(&features, &held) else {
                continue;
            };
            let left = DVector::from_vec(held.clone()) - &features * all;
            let sigma = median_deviation(left.as_slice()).max(*CURRENTS * most);
            let residual = held.iter().zip(&torque);
            let residual = residual.map(|(held, torque)| held * slope.signum() - torque);
            usable.push((joint, residual.collect(), sigma));
        }
        if usable.is_empty() {
            return None;
        }
        let joints: Vec<usize> = usable.iter().map(|(joint, ..)| *joint).collect();
        let residual =
            (0..rows.len()).flat_map(|i| usable.iter().map(move |(_, residual, _)| residual[i]));
        let direction = rows
            .iter()
            .flat_map(|row| joints.iter().map(|joint| data.direction(*row, *joint)));
        Some(Self {
            residual: residual.collect(),
            sigma: usable.iter().map(|(.., sigma)| *sigma).collect(),
            direction: direction.collect(),
            joints,
        })
    }

    pub(crate) fn residual_rows(&self) -> usize {
        self.residual.len()
    }

    /// Residuals in standard deviations.
    pub(crate) fn whitened(&self) -> impl Iterator<Item = f64> + '_ {
        self.residual
            .iter()
            .enumerate()
            .map(|(row, value)| value / self.sigma_of(row))
    }

    pub(crate) fn sigma_of(&self, row: usize) -> f64 {
        self.sigma[row % self.joints.len()]
    }

    /// Columns that each motor has of its own: bias and friction.
    pub(crate) fn nuisances(&self) -> usize {
        2 * self.joints.len()
    }

    /// Entry of a nuisance in a residual row, whitened.
    pub(crate) fn nuisance(&self, row: usize, column: usize) -> f64 {
        let joint = row % self.joints.len();
        match column {
            bias if bias == 2 * joint => 1.0 / self.sigma[joint],
            friction if friction == 2 * joint + 1 => self.direction[row] / self.sigma[joint],
            _ => 0.0,
        }
    }

    /// What the currents alone say of some parameters with whitened `columns` (of the residual rows of currents), now at `values`.
    pub(crate) fn priors(&self, columns: &[Vec<f64>], values: &[f64]) -> Option<Vec<Prior>> {
        let (rows, count) = (self.residual_rows(), columns.len());
        let by_columns = |row: usize| {
            let each = columns.iter().zip(values);
            each.map(|(column, x)| column[row] * x).sum::<f64>()
        };
        let seen = self.whitened().enumerate();
        let seen: Vec<f64> = seen.map(|(row, value)| value + by_columns(row)).collect();
        let length = |column: &Vec<f64>| column.iter().map(|v| v * v).sum::<f64>().sqrt();
        let scale: Vec<f64> = columns.iter().map(|one| length(one).max(1e-300)).collect();
        let matrix = DMatrix::from_fn(rows, count + self.nuisances(), |row, k| {
            if k < count {
                columns[k][row] / scale[k]
            } else {
                self.nuisance(row, k - count)
            }
        });
        let solution = solve(&matrix, &seen)?;
        let left = DVector::from_vec(seen) - &matrix * &solution;
        let scatter = left.norm_squared() / rows.saturating_sub(matrix.ncols()).max(1) as f64;
        let inverse = (matrix.transpose() * &matrix).pseudo_inverse(1e-10).ok()?;
        let prior = |k: usize| Prior {
            mean: solution[k] / scale[k],
            sigma: (scatter.max(1.0) * inverse[(k, k)]).sqrt().max(1e-12) / scale[k],
        };
        Some((0..count).map(prior).collect())
    }
}

fn solve(matrix: &DMatrix<f64>, values: &[f64]) -> Option<DVector<f64>> {
    matrix
        .clone()
        .svd(true, true)
        .solve(&DVector::from_column_slice(values), 1e-10)
        .ok()
}

fn median_deviation(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    1.4826 * nearest(&mut sizes, 0.5).unwrap_or_default()
}
