//! What the torque changes with the numbers of shapes: speeds, times, travels, and the width over which the sign of friction turns.
//!
//! They enter nonlinearly. Near the best ones the torque is linear in them (Gauss and Newton): as further columns of the least squares they
//! have a covariance with all coefficients, and what is not known of a shape is in the uncertainty of everything.
//!
//! How fast the sign of friction turns with velocity: the width under which base, viscous, Coulomb friction and offset leave least.

use crate::cause::TorqueForm;
use crate::problem::TorqueProblem;
use crate::reduce::TorqueColumn;
use crate::scene::{DynamicScene, SIGN_WIDTHS};
use crate::sweep::SweptColumns;
use crate::weighted::WeightedColumns;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// By what share a shape number is moved for a difference.
const STEP: f64 = 0.03;
/// Standard deviation of the logarithm of a shape number beforehand: of what the data hardly show, its size is known to a factor of three.
const BEFOREHAND: f64 = 1.0;

/// A number that is no coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ShapeNumber {
    /// Form, and position in its shape.
    Of(usize, usize),
    /// The width of all frictions' signs.
    SignWidth,
}

/// Columns of shape numbers behind those of all forms.
pub(super) struct ShapeSlopes(pub Vec<(ShapeNumber, usize)>);

impl ShapeSlopes {
    /// The slopes of a set at its solution; the columns join those of the problem.
    pub(crate) fn of(
        problem: &mut TorqueProblem,
        weighted: &mut WeightedColumns,
        set: &[usize],
    ) -> Self {
        let solution = SweptColumns::base(&problem.all, weighted)
            .with(set)
            .solution();
        let forms: Vec<TorqueForm> = set
            .iter()
            .map(|number| problem.all.forms[*number].clone())
            .collect();
        let values: Vec<Vec<f64>> = set
            .iter()
            .map(|number| problem.coefficients(*number, &solution))
            .collect();
        let values: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
        let mut numbers: Vec<(ShapeNumber, f64)> = Vec::new();
        for (number, form) in set.iter().zip(&forms) {
            let spans = form.shape_numbers().into_iter();
            numbers.extend(spans.map(|span| {
                let shape_number = ShapeNumber::Of(*number, span.index);
                (shape_number, form.shape[span.index])
            }));
        }
        numbers.push((ShapeNumber::SignWidth, problem.scene.sign_width));
        let (mut joints, mut courses) = (vec![Vec::new(); numbers.len()], Vec::new());
        for (number, joint, course) in planned_slopes(&forms, &values, &mut problem.scene, 0) {
            joints[number].push(joint);
            courses.push(course);
        }
        let mut courses = problem.reduction.reduce(courses).into_iter();
        let runs = problem.runs(false);
        let column = |((number, size), joints): ((ShapeNumber, f64), Vec<usize>)| {
            let slope = TorqueColumn {
                courses: courses.by_ref().take(joints.len()).collect(),
                joints,
            };
            weighted.push(&slope, problem.weighing(&runs));
            let column = problem.all.push_bare(slope);
            weighted.gram[column][column] += (BEFOREHAND * size).powi(-2);
            (number, column)
        };
        Self(numbers.into_iter().zip(joints).map(column).collect())
    }

    /// A fit that knows nothing of its shapes beforehand: for covariances.
    pub(crate) fn with_slopes<'a>(&self, sweep: &SweptColumns<'a>) -> SweptColumns<'a> {
        let mut all = sweep.clone();
        self.0.iter().for_each(|(_, column)| all.take(*column));
        all
    }

    /// Standard deviation of a shape number of a form, by a fit with the columns of all of them.
    pub(crate) fn sigma(&self, uncertain: &SweptColumns, form: usize, index: usize) -> Option<f64> {
        let (_, column) = self
            .0
            .iter()
            .find(|(known, _)| *known == ShapeNumber::Of(form, index))?;
        Some(uncertain.covariance(&[*column])[0].max(0.0).sqrt())
    }
}

/// Torque of forms at a joint as recorded per unit of each shape number they have, and of the width of a sign: `(number, joint, course)`,
/// numbers in the order of [`ShapeSlopes`], counted from `first`, and in that order.
pub(super) fn planned_slopes(
    forms: &[TorqueForm],
    coefficients: &[&[f64]],
    scene: &mut DynamicScene,
    first: usize,
) -> Vec<(usize, usize, Vec<f64>)> {
    let (mut slopes, mut next) = (Vec::new(), first);
    for (form, values) in forms.iter().zip(coefficients) {
        for span in form.shape_numbers() {
            let size = form.shape[span.index];
            for joint in form.acts_on(scene.joints()) {
                let [less, more] = [1.0 - STEP, 1.0 + STEP].map(|share| {
                    torque_at(
                        &form.with_shape(span.index, share * size),
                        values,
                        scene,
                        joint,
                    )
                });
                slopes.push((next, joint, difference(less, &more, 2.0 * STEP * size)));
            }
            next += 1;
        }
    }
    let width = scene.sign_width;
    for joint in 0..scene.joints() {
        let acting = || {
            forms.iter().zip(coefficients).filter(|(form, _)| {
                form.cause.of_sign && form.acts_on(scene.joints()).contains(&joint)
            })
        };
        let active: Vec<_> = acting().collect();
        let [less, more] = [1.0 - STEP, 1.0 + STEP].map(|share| {
            scene.sign_width = share * width;
            let mut sum = vec![0.0; scene.rows()];
            for (form, values) in &active {
                sum.iter_mut()
                    .zip(torque_at(form, values, scene, joint))
                    .for_each(|(sum, value)| *sum += value);
            }
            sum
        });
        slopes.push((next, joint, difference(less, &more, 2.0 * STEP * width)));
    }
    scene.sign_width = width;
    slopes
}

/// The slope of a function of a shape number.
pub(super) fn slope(size: f64, function: impl Fn(f64) -> f64) -> f64 {
    (function(size * (1.0 + STEP)) - function(size * (1.0 - STEP))) / (2.0 * STEP * size)
}

/// Nm, of a form with its coefficients at a joint.
fn torque_at(form: &TorqueForm, values: &[f64], scene: &DynamicScene, joint: usize) -> Vec<f64> {
    let (mut sum, mut course) = (vec![0.0; scene.rows()], vec![0.0; scene.rows()]);
    for (number, value) in values.iter().enumerate() {
        form.write(scene, joint, number, &mut course);
        sum.iter_mut()
            .zip(&course)
            .for_each(|(sum, part)| *sum += value * part);
    }
    sum
}

fn difference(mut less: Vec<f64>, more: &[f64], step: f64) -> Vec<f64> {
    less.iter_mut()
        .zip(more)
        .for_each(|(less, more)| *less = (more - *less) / step);
    less
}

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
    let of_joint = |joint: usize| {
        best_width(&mut |width| {
            problem.scene.turn_one_over(joint, width);
            fit.left_at(problem, joint)
        })
    };
    (0..fit.joints.len()).map(of_joint).collect()
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
        let of_joint = |(joint, inertial): (usize, Vec<Vec<f64>>)| {
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
            .map(of_joint)
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
        let signs = DVector::from_iterator(self.rows.len(), self.rows.iter().map(|row| sign[*row]));
        let apart = fit.apart(&signs);
        let gain = apart.dot(&fit.left).powi(2)
            / (apart.norm_squared() + RIDGE * signs.norm_squared() + f64::MIN_POSITIVE);
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

    /// Residual of a course after a fit of the columns.
    fn apart(&self, course: &DVector<f64>) -> DVector<f64> {
        match &self.factor {
            Some(factor) => course - &self.columns * factor.solve(&self.columns.tr_mul(course)),
            None => course.clone(),
        }
    }
}
