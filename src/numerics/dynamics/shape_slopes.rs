//! What the torque changes with the numbers of shapes: speeds, times, travels, and the width over which the sign of friction turns.
//!
//! They enter nonlinearly. Near the best ones the torque is linear in them (Gauss and Newton): as further columns of the least squares they
//! have a covariance with all coefficients, and what is not known of a shape is in the uncertainty of everything.

use super::cause::TorqueForm;
use super::problem::TorqueProblem;
use super::reduce::TorqueColumn;
use super::scene::DynamicScene;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;

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
                let of = ShapeNumber::Of(*number, span.index);
                (of, form.shape[span.index])
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
        let own: Vec<_> = acting().collect();
        let [less, more] = [1.0 - STEP, 1.0 + STEP].map(|share| {
            scene.sign_width = share * width;
            let mut sum = vec![0.0; scene.rows()];
            for (form, values) in &own {
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
pub(super) fn slope(size: f64, of: impl Fn(f64) -> f64) -> f64 {
    (of(size * (1.0 + STEP)) - of(size * (1.0 - STEP))) / (2.0 * STEP * size)
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
