//! How fast the sign of friction turns with velocity: the width under which base, viscous, Coulomb friction and offset leave least.

use super::problem::TorqueProblem;
use super::scene::SIGN_WIDTHS;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A fall of the logarithm of the mean square, summed over joints, that counts.
const BETTER: f64 = 1e-3;
/// Steps of the logarithm about the best of the grid: a width that is a little off looks like friction that falls with speed.
const STEPS: [f64; 4] = [0.35, 0.17, 0.08, 0.04];
/// What is added to the scaled inner products.
const RIDGE: f64 = 1e-6;

/// The best near one of [`SIGN_WIDTHS`], rad/s.
pub(super) fn sign_width(problem: &mut TorqueProblem) -> f64 {
    let fit = FrictionFit::new(problem);
    best_width(&mut |width| {
        problem.scene.turn_over(width);
        fit.left(problem).iter().sum()
    })
}

/// The best of each joint by itself, rad/s.
pub(super) fn joint_sign_widths(problem: &mut TorqueProblem) -> Vec<f64> {
    let fit = FrictionFit::new(problem);
    let of = |joint: usize| {
        best_width(&mut |width| {
            problem.scene.turn_one_over(joint, width);
            fit.left_at(problem, joint)
        })
    };
    (0..fit.joints.len()).map(of).collect()
}

/// The width that leaves least.
fn best_width(left_by: &mut dyn FnMut(f64) -> f64) -> f64 {
    let mut best = (f64::INFINITY, SIGN_WIDTHS[0]);
    let mut try_width = |width: f64, best: &mut (f64, f64)| {
        let left = left_by(width);
        if left < best.0 - BETTER {
            *best = (left, width);
        }
    };
    SIGN_WIDTHS
        .iter()
        .for_each(|width| try_width(*width, &mut best));
    for step in STEPS {
        let about = best.1;
        [about * (-step).exp(), about * step.exp()]
            .iter()
            .for_each(|width| try_width(*width, &mut best));
    }
    best.1
}

/// Base, viscous and Coulomb friction and offset, each joint by itself, on the fitted rows.
pub(super) struct FrictionFit {
    rows: Vec<usize>,
    joints: Vec<JointFit>,
}

/// What is there whichever way friction turns.
struct JointFit {
    /// Base, velocity and 1, scaled, with the factor of their inner products.
    columns: DMatrix<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
    /// Nm that they leave.
    left: DVector<f64>,
}

impl FrictionFit {
    /// The fit to the rows that count, by the torques as they are at present.
    pub(crate) fn new(problem: &TorqueProblem) -> Self {
        let rows: Vec<usize> = problem.runs(false).iter().flat_map(Clone::clone).collect();
        let velocities = problem.reduction.reduce(problem.scene.velocity.clone());
        let of = |(joint, inertial): (usize, Vec<Vec<f64>>)| {
            let velocity = rows.iter().map(|row| velocities[joint][*row]).collect();
            let columns: Vec<Vec<f64>> = inertial
                .into_iter()
                .chain([velocity, vec![1.0; rows.len()]])
                .collect();
            JointFit::new(&columns)
        };
        let joints = problem
            .base_courses(&rows)
            .into_iter()
            .enumerate()
            .map(of)
            .collect();
        let mut fit = Self { rows, joints };
        fit.take(&problem.measured);
        fit
    }

    /// Takes measured minus rigid torques, `[joint][judged row]`.
    pub(crate) fn take(&mut self, measured: &[Vec<f64>]) {
        for (fit, course) in self.joints.iter_mut().zip(measured) {
            fit.left = fit.apart(&DVector::from_iterator(
                self.rows.len(),
                self.rows.iter().map(|row| course[*row]),
            ));
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Logarithm of the mean square that is left at each joint as friction turns at present.
    pub(crate) fn left(&self, problem: &TorqueProblem) -> Vec<f64> {
        let signs = problem.reduction.reduce(
            (0..self.joints.len())
                .map(|joint| signs(problem, joint))
                .collect(),
        );
        self.joints
            .iter()
            .zip(&signs)
            .map(|(fit, sign)| self.left_by(fit, sign))
            .collect()
    }

    /// At one joint.
    fn left_at(&self, problem: &TorqueProblem, joint: usize) -> f64 {
        let sign = problem.reduction.reduce(vec![signs(problem, joint)]);
        self.left_by(&self.joints[joint], &sign[0])
    }

    fn left_by(&self, fit: &JointFit, sign: &[f64]) -> f64 {
        let own = DVector::from_iterator(self.rows.len(), self.rows.iter().map(|row| sign[*row]));
        let apart = fit.apart(&own);
        let gain = apart.dot(&fit.left).powi(2)
            / (apart.norm_squared() + RIDGE * own.norm_squared() + f64::MIN_POSITIVE);
        ((fit.left.norm_squared() - gain) / self.rows.len().max(1) as f64 + f64::MIN_POSITIVE).ln()
    }
}

/// How friction turns at a joint at present, all recorded rows.
fn signs(problem: &TorqueProblem, joint: usize) -> Vec<f64> {
    (0..problem.scene.rows())
        .map(|row| problem.scene.direction(joint, row))
        .collect()
}

impl JointFit {
    fn new(columns: &[Vec<f64>]) -> Self {
        let norm =
            |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt() + 1e-12;
        let rows = columns.last().map_or(0, Vec::len);
        let scales: Vec<f64> = columns.iter().map(|column| norm(column)).collect();
        let columns = DMatrix::from_fn(rows, columns.len(), |row, column| {
            columns[column][row] / scales[column]
        });
        let mut gram = columns.tr_mul(&columns);
        (0..gram.nrows()).for_each(|k| gram[(k, k)] += RIDGE);
        Self {
            factor: gram.cholesky(),
            columns,
            left: DVector::zeros(rows),
        }
    }

    /// What the columns leave of a course.
    fn apart(&self, course: &DVector<f64>) -> DVector<f64> {
        match &self.factor {
            Some(factor) => course - &self.columns * factor.solve(&self.columns.tr_mul(course)),
            None => course.clone(),
        }
    }
}
