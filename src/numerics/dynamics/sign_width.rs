//! How fast the sign of friction turns with velocity: the width under which base, viscous, Coulomb friction and offset leave least.

use super::problem::TorqueProblem;
use super::scene::SIGN_WIDTHS;
use nalgebra::{DMatrix, DVector};

/// A fall of the logarithm of the mean square, summed over joints, that counts.
const BETTER: f64 = 1e-3;
/// Steps of the logarithm about the best of the grid: a width that is a little off looks like friction that falls with speed.
const STEPS: [f64; 4] = [0.35, 0.17, 0.08, 0.04];
/// Of the scaled inner products.
const RIDGE: f64 = 1e-6;

/// The best near one of [`SIGN_WIDTHS`], rad/s.
pub(super) fn sign_width(problem: &mut TorqueProblem) -> f64 {
    let fit = FrictionFit::new(problem);
    let mut left_by = |width: f64| {
        problem.scene.sign_width = width;
        fit.left(problem).iter().sum::<f64>()
    };
    let mut best = (f64::INFINITY, SIGN_WIDTHS[0]);
    let mut try_width = |width: f64, best: &mut (f64, f64)| {
        let left = left_by(width);
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

/// Base, viscous and Coulomb friction and offset, each joint by itself, on the fitted rows.
pub(super) struct FrictionFit {
    rows: Vec<usize>,
    /// `[joint][column][fitted row]`.
    base: Vec<Vec<Vec<f64>>>,
}

impl FrictionFit {
    /// Of the rows that count at present.
    pub fn new(problem: &TorqueProblem) -> Self {
        let rows: Vec<usize> = problem.runs(false).iter().flat_map(Clone::clone).collect();
        Self { base: problem.base_courses(&rows), rows }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Logarithm of the mean square that is left at each joint as friction turns at present.
    pub fn left(&self, problem: &TorqueProblem) -> Vec<f64> {
        let (scene, mut room) = (&problem.scene, Vec::new());
        let mut of = |(joint, inertial): (usize, &Vec<Vec<f64>>)| {
            let signs = (0..scene.rows()).map(|row| scene.direction(joint, row)).collect::<Vec<f64>>();
            let courses = [scene.velocity[joint].clone(), signs, vec![1.0; scene.rows()]];
            let reduced = courses.map(|mut course| problem.reduction.reduce(&mut course, &mut room));
            let friction = reduced.iter().map(|course| self.rows.iter().map(|row| course[*row]).collect::<Vec<f64>>());
            let columns: Vec<Vec<f64>> = inertial.iter().cloned().chain(friction).collect();
            let measured: Vec<f64> = self.rows.iter().map(|row| problem.measured[joint][*row]).collect();
            mean_square_left(&columns, &measured).ln()
        };
        self.base.iter().enumerate().map(|one| of(one)).collect()
    }
}

/// Of a fit of scaled columns.
fn mean_square_left(columns: &[Vec<f64>], measured: &[f64]) -> f64 {
    let norm = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt() + 1e-12;
    let rows = DMatrix::from_fn(measured.len(), columns.len(), |row, column| columns[column][row]);
    let scales: Vec<f64> = columns.iter().map(|column| norm(column)).collect();
    let rows = DMatrix::from_fn(rows.nrows(), rows.ncols(), |row, column| rows[(row, column)] / scales[column]);
    let measured = DVector::from_column_slice(measured);
    let mut gram = rows.tr_mul(&rows);
    (0..gram.nrows()).for_each(|k| gram[(k, k)] += RIDGE);
    let right = rows.tr_mul(&measured);
    let Some(factor) = gram.cholesky() else { return measured.norm_squared() / measured.len() as f64 };
    let left = &measured - &rows * factor.solve(&right);
    left.norm_squared() / measured.len().max(1) as f64 + f64::MIN_POSITIVE
}
