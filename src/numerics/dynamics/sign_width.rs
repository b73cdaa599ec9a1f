//! How fast the sign of friction turns with velocity: the width under which base, viscous, Coulomb friction and offset leave least.

use super::problem::TorqueProblem;
use super::scene::SIGN_WIDTHS;
use super::weighted::dot;
use nalgebra::{DMatrix, DVector};

/// A fall of the logarithm of the mean square, summed over joints, that counts.
const BETTER: f64 = 1e-3;
/// Steps of the logarithm about the best of the grid: a width that is a little off looks like friction that falls with speed.
const STEPS: [f64; 4] = [0.35, 0.17, 0.08, 0.04];
/// Of the scaled inner products.
const RIDGE: f64 = 1e-6;

/// The best near one of [`SIGN_WIDTHS`], rad/s.
pub(super) fn sign_width(problem: &mut TorqueProblem) -> f64 {
    let runs = problem.runs(false);
    let rows: Vec<usize> = runs.iter().flat_map(Clone::clone).collect();
    let chosen = |course: &Vec<f64>| rows.iter().map(|row| course[*row]).collect::<Vec<f64>>();
    let velocities = problem.reduction.reduce(problem.scene.velocity.clone());
    let constant = problem.reduction.reduce(vec![vec![1.0; problem.scene.rows()]]);
    let of_joint = |(joint, inertial): (usize, Vec<Vec<f64>>)| {
        let columns = inertial.into_iter().chain([chosen(&velocities[joint]), chosen(&constant[0])]).collect();
        SteadyColumns::new(columns, &chosen(&problem.measured[joint]))
    };
    let steady: Vec<SteadyColumns> = problem.base_courses(&rows).into_iter().enumerate().map(of_joint).collect();
    let mut left_by = |width: f64| {
        problem.scene.sign_width = width;
        let scene = &problem.scene;
        let sign = |course: &Vec<f64>| course.iter().map(|velocity| scene.sign(*velocity)).collect::<Vec<f64>>();
        let signs = problem.reduction.reduce(scene.velocity.iter().map(sign).collect());
        steady.iter().zip(&signs).map(|(steady, sign)| steady.mean_square_left(&chosen(sign)).ln()).sum()
    };
    let mut best = (f64::INFINITY, SIGN_WIDTHS[0]);
    let mut try_width = |width: f64, best: &mut (f64, f64)| {
        let left: f64 = left_by(width);
        if left < best.0 - BETTER {
            *best = (left, width);
        }
    };
    SIGN_WIDTHS.iter().for_each(|width| try_width(*width, &mut best));
    for step in STEPS {
        let about = best.1;
        [about * (-step).exp(), about * step.exp()].iter().for_each(|width| try_width(*width, &mut best));
    }
    best.1
}

/// What stands beside the sign of a joint whatever its width, scaled, and the torque that all of it explains.
struct SteadyColumns {
    rows: DMatrix<f64>,
    /// Inner products of these columns, and with the torque.
    gram: DMatrix<f64>,
    right: DVector<f64>,
    measured: DVector<f64>,
}

impl SteadyColumns {
    fn new(columns: Vec<Vec<f64>>, measured: &[f64]) -> Self {
        let mut rows = DMatrix::zeros(measured.len(), columns.len());
        for (column, values) in columns.iter().enumerate() {
            let scale = scale(values);
            rows.column_mut(column).iter_mut().zip(values).for_each(|(entry, value)| *entry = value / scale);
        }
        let measured = DVector::from_column_slice(measured);
        let mut gram = DMatrix::zeros(columns.len(), columns.len());
        for a in 0..columns.len() {
            for b in 0..=a {
                let product = dot(rows.column(a).as_slice(), rows.column(b).as_slice());
                (gram[(a, b)], gram[(b, a)]) = (product, product);
            }
        }
        let right = rows.tr_mul(&measured);
        Self { rows, gram, right, measured }
    }

    /// Of a fit together with a sign.
    fn mean_square_left(&self, sign: &[f64]) -> f64 {
        let scale = scale(sign);
        let sign = DVector::from_iterator(sign.len(), sign.iter().map(|value| value / scale));
        let beside = self.rows.tr_mul(&sign);
        let count = beside.len();
        let mut gram = self.gram.clone().resize(count + 1, count + 1, 0.0);
        for (column, product) in beside.iter().enumerate() {
            (gram[(column, count)], gram[(count, column)]) = (*product, *product);
        }
        gram[(count, count)] = sign.norm_squared();
        (0..=count).for_each(|k| gram[(k, k)] += RIDGE);
        let right = self.right.clone().push(sign.dot(&self.measured));
        let all = self.measured.len().max(1) as f64;
        let Some(factor) = gram.cholesky() else { return self.measured.norm_squared() / all };
        let solution = factor.solve(&right);
        let left = &self.measured - &self.rows * solution.rows(0, count) - sign * solution[count];
        left.norm_squared() / all + f64::MIN_POSITIVE
    }
}

fn scale(column: &[f64]) -> f64 {
    column.iter().map(|value| value * value).sum::<f64>().sqrt() + 1e-12
}
