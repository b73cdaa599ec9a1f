//! Shape numbers of what was found (speeds, times, travels): finer and finer grids about each, then all at once with the coefficients and the
//! width over which the sign of friction turns, by steps of Gauss and Newton: one number after the other stays where two go together.

use super::cause::{SHARE, ShapeSpan, TorqueForm};
use super::columns::TorqueColumn;
use super::problem::{TorqueProblem, basic_forms};
use super::recording::{add, square};
use super::scene::{DynamicScene, SIGN_WIDTHS};
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::criteria::torque::{BETTER, UNUSUAL};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Half widths of the grids: of the logarithm, or of the number itself.
const HALVES: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
/// Points on either side.
const POINTS: i32 = 3;

/// Replaces forms of a set by better shaped ones; tells whether any was.
pub(super) fn refine(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
) -> bool {
    let before = set.to_vec();
    for place in 0..set.len() {
        refine_at(problem, weighted, set, place);
    }
    before != set
}

/// The same of the form at one place of a set.
fn refine_at(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
    place: usize,
) {
    let form = &problem.all.forms[set[place]];
    for span in (form.cause.spans)(form) {
        for half in HALVES {
            try_grid(problem, weighted, set, place, &span, half);
            // What the coarsest grid leaves as it usually is stays so.
            if span.usual == Some(problem.all.forms[set[place]].shape[span.index]) {
                break;
            }
        }
    }
}

/// Rounds of grids from the best start of a law of a user's own.
const OWN_ROUNDS: usize = 2;

/// Lists laws of a user's own also in the shape in which each explains most at its joint in addition to viscous and Coulomb friction: a law
/// between its starts would look like a sum of others. Products that were formed before are those of other columns then.
pub(super) fn list_own_shapes(problem: &mut TorqueProblem, mut weighted: WeightedColumns) {
    let listed = problem.all.listed;
    let forms = problem.all.forms[..listed].to_vec();
    let is_own = |form: &usize| {
        let form = &forms[*form];
        form.law.is_some() && !form.shape.is_empty()
    };
    let own: Vec<usize> = (0..listed).filter(is_own).collect();
    let (mut set, mut found) = (basic_forms(problem), Vec::new());
    let place = set.len();
    for starts in own.chunk_by(|a, b| forms[*a].is_called_as(&forms[*b])) {
        let sweep = SweptColumns::base(&problem.all, &weighted).with(&set[..place]);
        let gains = starts.iter().map(|start| (*start, sweep.gain(*start)));
        let Some((best, _)) = gains.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            continue;
        };
        set.truncate(place);
        set.push(best);
        for _ in 0..OWN_ROUNDS {
            refine_at(problem, &mut weighted, &mut set, place);
        }
        found.push(problem.all.forms[set[place]].clone());
    }
    problem.all.forget(listed);
    for form in found {
        problem.push(form);
    }
    problem.all.listed = problem.all.forms.len();
}

/// One grid about the present number.
fn try_grid(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
    place: usize,
    span: &ShapeSpan,
    half: f64,
) {
    let form = problem.all.forms[set[place]].clone();
    let now = form.shape[span.index];
    let mut trials = vec![set[place]];
    let is_usual = span.usual == Some(now);
    let is_tried = |point: &i32| match is_usual {
        true => point.abs() == POINTS,
        false => *point != 0,
    };
    for point in (-POINTS..=POINTS).filter(is_tried) {
        let step = half * f64::from(point) / f64::from(POINTS);
        let moved = match span.by_ratio {
            true => now * step.exp(),
            false => now + step * span.size(now),
        };
        if moved >= span.least && moved <= span.most {
            trials.push(push(problem, weighted, form.with_shape(span.index, moved)));
        }
    }
    let others = set.iter().copied().enumerate();
    let others = others.filter(|(other, _)| *other != place);
    let others: Vec<usize> = others.map(|(_, form)| form).collect();
    let sweep = SweptColumns::base(&problem.all, weighted).with(&others);
    let gains = trials.iter().map(|number| (*number, sweep.gain(*number)));
    let (best, gain) = gains
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((set[place], 0.0));
    let asked = match is_usual {
        true => *UNUSUAL + (weighted.rows as f64).ln(),
        false => *BETTER,
    };
    if gain > sweep.gain(set[place]) + asked {
        set[place] = best;
    }
}

/// Steps, at most.
const STEPS: usize = 3;
/// A number changes by less than this factor in a step.
const FARTHEST: f64 = 1.4;
/// rad/s between which the width lies.
const WIDTHS: [f64; 2] = [5e-4, 0.2];

/// A form as a number of the problem.
pub(super) fn push(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    form: TorqueForm,
) -> usize {
    let number = problem.push(form);
    let runs = problem.runs(false);
    problem
        .all
        .of(number)
        .for_each(|column| weighted.push(&problem.all.columns[column], problem.weighing(&runs)));
    number
}

/// Moves the numbers of a set to where the residual is least.
pub(super) fn polish(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
) {
    for _ in 0..STEPS {
        if !step(problem, weighted, set) {
            break;
        }
    }
}

/// One step; whether it was worth it.
fn step(problem: &mut TorqueProblem, weighted: &mut WeightedColumns, set: &mut [usize]) -> bool {
    let before = set.to_vec();
    let slopes = ShapeSlopes::of(problem, weighted, set);
    let (square, solution) = {
        let sweep = SweptColumns::base(&problem.all, weighted).with(set);
        (sweep.square, slopes.with_slopes(&sweep).solution())
    };
    let width = problem.scene.sign_width;
    for (number, column) in &slopes.0 {
        let Some((_, change)) = solution.iter().find(|(pivot, _)| pivot == column) else {
            continue;
        };
        match *number {
            ShapeNumber::SignWidth => {
                problem.scene.sign_width = moved(width, *change, width, WIDTHS);
            }
            ShapeNumber::Of(form, index) => {
                let place = before.iter().position(|known| *known == form);
                let spans = problem.all.forms[form].shape_numbers();
                let span = spans.into_iter().find(|span| span.index == index);
                let (Some(place), Some(span)) = (place, span) else {
                    continue;
                };
                let form = &problem.all.forms[set[place]];
                let value = form.shape[index];
                let value = moved(value, *change, span.size(value), [span.least, span.most]);
                set[place] = problem.push(form.with_shape(index, value));
            }
        }
    }
    problem.renew_signs(set);
    *weighted = problem.weighted_of(set);
    if SweptColumns::base(&problem.all, weighted).with(set).square < square - *BETTER {
        return true;
    }
    set.copy_from_slice(&before);
    problem.scene.sign_width = width;
    problem.renew_signs(set);
    *weighted = problem.weighted_of(set);
    false
}

/// A number of a size after a change, within its ends.
fn moved(value: f64, change: f64, size: f64, [least, most]: [f64; 2]) -> f64 {
    let change = change.clamp((1.0 / FARTHEST - 1.0) * size, (FARTHEST - 1.0) * size);
    (value + change).clamp(least, most)
}

/// Takes forms with a number at an end of its search out of a set, and their causes out of the search at their places; tells whether any was.
pub(super) fn take_out_ends(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut Vec<usize>,
) -> bool {
    let before = set.clone();
    for number in before.iter().copied() {
        let form = problem.all.forms[number].clone();
        let place = set.iter().position(|other| *other == number);
        match (form.within_ends(), place) {
            (Some(within), Some(place)) if within.shape != form.shape => {
                set[place] = push(problem, weighted, within);
            }
            (None, Some(place)) => {
                set.remove(place);
                problem.barred.push(form);
            }
            _ => (),
        }
    }
    before != *set
}

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
        let mut numbers: Vec<(ShapeNumber, f64)> = Vec::new();
        for (number, form) in set.iter().zip(&forms) {
            let spans = form.shape_numbers().into_iter();
            numbers.extend(spans.map(|span| {
                let shape_number = ShapeNumber::Of(*number, span.index);
                (shape_number, span.size(form.shape[span.index]))
            }));
        }
        numbers.push((ShapeNumber::SignWidth, problem.scene.sign_width));
        let (mut joints, mut courses) = (vec![Vec::new(); numbers.len()], Vec::new());
        for (number, joint, course) in planned_slopes(&forms, &values, &mut problem.scene) {
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

    /// Their columns.
    pub(crate) fn columns(&self) -> impl Iterator<Item = usize> {
        self.0.iter().map(|(_, column)| *column)
    }

    /// The column of one of them.
    pub(crate) fn column(&self, number: ShapeNumber) -> Option<usize> {
        let known = self.0.iter().find(|(known, _)| *known == number);
        known.map(|(_, column)| *column)
    }

    /// Standard deviation of a shape number of a form, by a fit with the columns of all of them.
    pub(crate) fn sigma(&self, uncertain: &SweptColumns, form: usize, index: usize) -> Option<f64> {
        let column = self.column(ShapeNumber::Of(form, index));
        column.map(|column| uncertain.sigma(column))
    }
}

/// Torque of forms at a joint as recorded per unit of each shape number they have, and of the width of a sign: `(number, joint, course)`,
/// numbers in the order of [`ShapeSlopes`].
pub(super) fn planned_slopes<C: AsRef<[f64]>>(
    forms: &[TorqueForm],
    coefficients: &[C],
    scene: &mut DynamicScene,
) -> Vec<(usize, usize, Vec<f64>)> {
    let (mut slopes, mut next) = (Vec::new(), 0);
    for (form, values) in forms.iter().zip(coefficients) {
        for span in form.shape_numbers() {
            let value = form.shape[span.index];
            let size = span.size(value);
            for joint in form.acts_on(scene.joints()) {
                let [less, more] = [-SHARE, SHARE].map(|share| {
                    let moved = form.with_shape(span.index, value + share * size);
                    torque_at(&moved, values.as_ref(), scene, joint)
                });
                slopes.push((next, joint, difference(less, &more, 2.0 * SHARE * size)));
            }
            next += 1;
        }
    }
    let width = scene.sign_width;
    for joint in 0..scene.joints() {
        let acts = |form: &TorqueForm| form.acts_on(scene.joints()).contains(&joint);
        let acting = forms.iter().zip(coefficients);
        let acting = acting.filter(|(form, _)| form.cause.of_sign && acts(form));
        let acting: Vec<_> = acting.collect();
        let [less, more] = [1.0 - SHARE, 1.0 + SHARE].map(|share| {
            scene.sign_width = share * width;
            let mut sum = vec![0.0; scene.rows()];
            for (form, values) in &acting {
                add(
                    &mut sum,
                    1.0,
                    &torque_at(form, values.as_ref(), scene, joint),
                );
            }
            sum
        });
        slopes.push((next, joint, difference(less, &more, 2.0 * SHARE * width)));
    }
    scene.sign_width = width;
    slopes
}

/// Nm, of a form with its coefficients at a joint.
fn torque_at(form: &TorqueForm, values: &[f64], scene: &DynamicScene, joint: usize) -> Vec<f64> {
    let (mut sum, mut course) = (vec![0.0; scene.rows()], vec![0.0; scene.rows()]);
    for (number, value) in values.iter().enumerate() {
        form.write(scene, joint, number, &mut course);
        add(&mut sum, *value, &course);
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
const NARROWER: f64 = 1e-3;
/// Steps of the logarithm about the best of the grid: a width that is a little off looks like friction that falls with speed.
const FINER: [f64; 4] = [0.35, 0.17, 0.08, 0.04];
/// What is added to the scaled inner products.
const RIDGE: f64 = 1e-6;

/// The best near one of [`SIGN_WIDTHS`], rad/s.
fn sign_width(problem: &mut TorqueProblem) -> f64 {
    let fit = FrictionFit::new(problem);
    best_width(&mut |width| {
        problem.scene.turn_over(width);
        fit.left(problem).iter().sum()
    })
}

/// Takes the width that is best for all joints, or that of each by itself: where it is asked for, and where some joints turn and others slide,
/// whose speeds have other units.
pub(super) fn take_sign_widths(problem: &mut TorqueProblem, each: bool) {
    let width = sign_width(problem);
    problem.scene.turn_over(width);
    let slides = &problem.scene.arm.prismatic;
    if each || (slides.contains(&true) && slides.contains(&false)) {
        let widths = joint_sign_widths(problem);
        problem.scene.turn_each_over(widths);
    }
}

/// The best of each joint by itself, rad/s.
fn joint_sign_widths(problem: &mut TorqueProblem) -> Vec<f64> {
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
        if left < best.0 - NARROWER {
            *best = (left, width);
        }
    };
    SIGN_WIDTHS
        .iter()
        .for_each(|width| try_width(*width, &mut best));
    for step in FINER {
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
        let rows = problem.counted_rows(false);
        let velocities = problem.reduction.reduce(problem.scene.velocity.clone());
        let of_joint = |(joint, inertial): (usize, Vec<Vec<f64>>)| {
            let velocity = rows.iter().map(|row| velocities[joint][*row]).collect();
            let columns: Vec<Vec<f64>> = inertial
                .into_iter()
                .chain([velocity, vec![1.0; rows.len()]])
                .collect();
            JointFit::new(&columns)
        };
        let inertial = problem.base_courses(&rows).into_iter().enumerate();
        let joints = inertial.map(of_joint).collect();
        let mut fit = Self { rows, joints };
        fit.take(&problem.measured);
        fit
    }

    /// Takes measured minus rigid torques, `[joint][judged row]`.
    pub(crate) fn take(&mut self, measured: &[Vec<f64>]) {
        for (fit, course) in self.joints.iter_mut().zip(measured) {
            fit.left = fit.apart(&chosen(course, &self.rows));
        }
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Logarithm of the mean square that is left at each joint as friction turns at present.
    pub(crate) fn left(&self, problem: &TorqueProblem) -> Vec<f64> {
        let joints = 0..self.joints.len();
        let signs = joints.map(|joint| signs(problem, joint)).collect();
        let signs = problem.reduction.reduce(signs);
        let fits = self.joints.iter().zip(&signs);
        fits.map(|(fit, sign)| self.left_by(fit, sign)).collect()
    }

    /// At one joint.
    fn left_at(&self, problem: &TorqueProblem, joint: usize) -> f64 {
        let sign = problem.reduction.reduce(vec![signs(problem, joint)]);
        self.left_by(&self.joints[joint], &sign[0])
    }

    fn left_by(&self, fit: &JointFit, sign: &[f64]) -> f64 {
        let signs = chosen(sign, &self.rows);
        let apart = fit.apart(&signs);
        let gain = apart.dot(&fit.left).powi(2)
            / (apart.norm_squared() + RIDGE * signs.norm_squared() + f64::MIN_POSITIVE);
        ((fit.left.norm_squared() - gain) / self.rows.len().max(1) as f64 + f64::MIN_POSITIVE).ln()
    }
}

/// Some rows of a course.
fn chosen(course: &[f64], rows: &[usize]) -> DVector<f64> {
    DVector::from_iterator(rows.len(), rows.iter().map(|row| course[*row]))
}

/// How friction turns at a joint at present, all recorded rows.
fn signs(problem: &TorqueProblem, joint: usize) -> Vec<f64> {
    (0..problem.scene.rows())
        .map(|row| problem.scene.direction(joint, row))
        .collect()
}

impl JointFit {
    fn new(columns: &[Vec<f64>]) -> Self {
        let rows = columns.last().map_or(0, Vec::len);
        let norm = |column: &Vec<f64>| square(column).sqrt() + 1e-12;
        let scales: Vec<f64> = columns.iter().map(norm).collect();
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
