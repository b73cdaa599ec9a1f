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
    let runs = problem.runs(false);
    let rows: Vec<usize> = runs.iter().flat_map(Clone::clone).collect();
    let base = problem.base_courses(&rows);
    let mut room = Vec::new();
    let mut left_by = |width: f64| {
        problem.scene.sign_width = width;
        let mut left = 0.0;
        for (joint, inertial) in base.iter().enumerate() {
            let scene = &problem.scene;
            let signs = scene.velocity[joint].iter().map(|velocity| scene.sign(*velocity)).collect::<Vec<f64>>();
            let courses = [scene.velocity[joint].clone(), signs, vec![1.0; scene.rows()]];
            let reduced = courses.map(|mut course| problem.reduction.reduce(&mut course, &mut room));
            let friction = reduced.iter().map(|course| rows.iter().map(|row| course[*row]).collect::<Vec<f64>>());
            let columns: Vec<Vec<f64>> = inertial.iter().cloned().chain(friction).collect();
            let measured: Vec<f64> = rows.iter().map(|row| problem.measured[joint][*row]).collect();
            left += mean_square_left(&columns, &measured).ln();
        }
        left
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
