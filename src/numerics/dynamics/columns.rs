//! From rows as recorded to judged rows: one low-pass, alike for measured torque and every column, then fewer rows; and the columns of the
//! regressor, of the base and of every form so.
//!
//! Base parameters: inertial numbers that torques can determine, by QR with column pivoting of the stacked regressor (Gautier, 1991).

use super::arm::{INERTIAL_NUMBERS, unit_number};
use super::cause::{InertialChanges, TorqueForm};
use super::filter::ZeroPhase;
use super::newton_euler::InverseDynamics;
use super::recording::{RecordingClock, add, largest, square};
use super::scene::{DynamicScene, split};
use crate::criteria::torque::FRICTION;
use std::ops::Range;

/// s cut off at each end of a stretch: the filters settle there.
const SETTLING: f64 = 0.3;
/// Judged rows a second over the cut-off.
const RATE_OVER_CUTOFF: f64 = 2.5;
/// Judged rows at most: of longer recordings fewer a second.
const LIMIT: usize = 4000;
/// Rows that a block of a long stretch holds, its margins apart.
const BLOCK: usize = 1 << 14;

/// The low-pass and the rows that are kept.
#[derive(Debug, Clone)]
pub(super) struct Reduction {
    /// Hz.
    pub(crate) cutoff: f64,
    /// Hz, of kept rows.
    pub(crate) rate: f64,
    /// Kept rows of the recording, ascending.
    pub(crate) rows: Vec<usize>,
    /// Runs of kept rows without a gap.
    pub(crate) runs: Vec<Range<usize>>,
    filter: ZeroPhase,
    stretches: Vec<Range<usize>>,
    /// Rows beyond which a block does not feel what is filtered with it.
    margin: usize,
}

impl Reduction {
    /// The reduction by a clock and a cut-off (Hz).
    pub(crate) fn new(clock: &RecordingClock, cutoff: f64) -> Self {
        let recorded: usize = clock.stretches.iter().map(Range::len).sum();
        let every = ((clock.rate / (RATE_OVER_CUTOFF * cutoff)).round() as usize)
            .max(recorded.div_ceil(LIMIT))
            .max(1);
        let settling = (SETTLING * clock.rate) as usize;
        let (mut rows, mut runs) = (Vec::new(), Vec::new());
        for stretch in &clock.stretches {
            let first = rows.len();
            rows.extend(
                (stretch.start + settling..stretch.end.saturating_sub(settling)).step_by(every),
            );
            runs.push(first..rows.len());
        }
        runs.retain(|run| !run.is_empty());
        Self {
            cutoff,
            rate: clock.rate / every as f64,
            rows,
            runs,
            filter: ZeroPhase::new(clock.rate, cutoff),
            stretches: clock.stretches.clone(),
            margin: (10.0 * clock.rate / cutoff) as usize,
        }
    }

    /// Filters whole courses (as long as the recording) in place.
    pub(crate) fn filter(&self, courses: &mut [Vec<f64>]) {
        for stretch in &self.stretches {
            self.filter.apply_to(courses, stretch);
        }
    }

    /// The kept rows of courses as they were recorded.
    pub(crate) fn reduce(&self, mut courses: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        self.filter(&mut courses);
        courses
            .into_iter()
            .map(|course| self.rows.iter().map(|row| course[*row]).collect())
            .collect()
    }

    /// Kept rows of `width` courses that `write` makes for a range of rows, column after column (each as long as the range): the memory
    /// is that of a block.
    pub(crate) fn reduce_blocks(
        &self,
        width: usize,
        mut write: impl FnMut(Range<usize>, &mut [f64]),
    ) -> Vec<Vec<f64>> {
        let mut kept = vec![Vec::with_capacity(self.rows.len()); width];
        let (mut block, mut next) = (Vec::new(), 0);
        for stretch in &self.stretches {
            for start in stretch.clone().step_by(BLOCK) {
                let end = (start + BLOCK).min(stretch.end);
                let wide = start.saturating_sub(self.margin).max(stretch.start)
                    ..(end + self.margin).min(stretch.end);
                let long = wide.len();
                block.clear();
                block.resize(width * long, 0.0);
                write(wide.clone(), &mut block);
                let last = next + self.rows[next..].partition_point(|row| *row < end);
                let mut courses: Vec<&mut [f64]> = block.chunks_exact_mut(long).collect();
                self.filter.apply(&mut courses);
                for (course, kept) in courses.iter().zip(&mut kept) {
                    kept.extend(
                        self.rows[next..last]
                            .iter()
                            .map(|row| course[row - wide.start]),
                    );
                }
                next = last;
            }
        }
        kept
    }
}

/// What a coefficient changes: courses of judged rows at some joints.
#[derive(Debug, Clone, Default)]
pub(super) struct TorqueColumn {
    /// Ascending, from 0.
    pub(crate) joints: Vec<usize>,
    /// One a joint.
    pub(crate) courses: Vec<Vec<f64>>,
}

impl TorqueColumn {
    /// Adds it with a coefficient to torques, `[joint][judged row]`.
    pub(crate) fn add(&self, coefficient: f64, torques: &mut [Vec<f64>]) {
        for (joint, course) in self.joints.iter().zip(&self.courses) {
            add(&mut torques[*joint], coefficient, course);
        }
    }

    /// Its course at a joint, if it has one.
    pub(crate) fn at(&self, joint: usize) -> Option<&[f64]> {
        let place = self.joints.iter().position(|one| *one == joint)?;
        Some(&self.courses[place])
    }

    /// The same with other courses at its joints.
    pub(crate) fn map(&self, course: impl Fn(usize, &[f64]) -> Vec<f64>) -> Self {
        let courses = self.joints.iter().zip(&self.courses);
        Self {
            courses: courses.map(|(joint, one)| course(*joint, one)).collect(),
            joints: self.joints.clone(),
        }
    }
}

/// Judged rows of the regressor, `[joint][10 link + number]`; links before the joint are empty.
pub(super) struct ReducedRegressor(Vec<Vec<Vec<f64>>>);

impl ReducedRegressor {
    /// The regressor of the motion of a recording.
    pub(crate) fn of(scene: &DynamicScene, reduction: &Reduction) -> Self {
        let n = scene.joints();
        let mut dynamics = InverseDynamics::new(scene.arm);
        // Courses of joint j begin where those of the joints before end.
        let first: Vec<usize> = (0..n)
            .map(|joint| INERTIAL_NUMBERS * (joint * n - joint * joint.saturating_sub(1) / 2))
            .collect();
        let width = INERTIAL_NUMBERS * n * (n + 1) / 2;
        let mut motion = vec![0.0; 3 * n];
        let courses = reduction.reduce_blocks(width, |rows, block| {
            let long = rows.len();
            for row in rows.clone() {
                scene.motion_into(row, &mut motion);
                dynamics.regressor(
                    split(&motion, n),
                    &scene.arm.gravity,
                    |joint, link, numbers| {
                        let course = first[joint] + INERTIAL_NUMBERS * (link - joint);
                        for (number, value) in numbers.iter().enumerate() {
                            block[(course + number) * long + row - rows.start] = *value;
                        }
                    },
                );
            }
        });
        let mut courses = courses.into_iter();
        let of_joint = |joint: usize| {
            let before = (0..INERTIAL_NUMBERS * joint).map(|_| Vec::new());
            before
                .chain(courses.by_ref().take(INERTIAL_NUMBERS * (n - joint)))
                .collect()
        };
        Self((0..n).map(of_joint).collect())
    }

    /// Number of joints.
    pub(crate) fn joints(&self) -> usize {
        self.0.len()
    }

    /// Course of one number at a joint; empty where the link is before the joint.
    pub(crate) fn course(&self, joint: usize, number: usize) -> &[f64] {
        &self.0[joint][number]
    }

    /// The column of a change of a link's ten numbers.
    pub(crate) fn column(&self, link: usize, ten: &[f64; INERTIAL_NUMBERS]) -> TorqueColumn {
        let joints: Vec<usize> = (0..=link).collect();
        let course = |joint: &usize| {
            let sensitivities =
                &self.0[*joint][INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)];
            let mut sum = vec![0.0; sensitivities[0].len()];
            let shares = sensitivities.iter().zip(ten);
            for (course, share) in shares.filter(|(_, share)| **share != 0.0) {
                add(&mut sum, *share, course);
            }
            sum
        };
        TorqueColumn {
            courses: joints.iter().map(course).collect(),
            joints,
        }
    }

    /// Columns of changes of links' numbers.
    pub(crate) fn columns(&self, changes: &InertialChanges) -> Vec<TorqueColumn> {
        let of_change = |(link, ten): &(usize, _)| self.column(*link, ten);
        changes.iter().map(of_change).collect()
    }

    /// Torque of 10 n numbers at a joint.
    pub(crate) fn torque(&self, joint: usize, theta: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.0[joint].last().map_or(0, Vec::len)];
        let shares = self.0[joint].iter().zip(theta);
        for (course, share) in shares.skip(INERTIAL_NUMBERS * joint) {
            add(&mut sum, *share, course);
        }
        sum
    }
}

/// A column of which less than this share is new is a combination of others.
const DEPENDENT: f64 = 1e-7;
/// A column smaller than this share of the largest acts on no joint.
const IDLE: f64 = 1e-9;

/// Numbers (10 link + number, ascending) whose columns are independent over the rows of a recording.
pub(super) fn base_parameters(regressor: &ReducedRegressor) -> Vec<usize> {
    let n = regressor.joints();
    let rows = regressor.course(n - 1, INERTIAL_NUMBERS * n - 1).len();
    let stacked = |number: usize| {
        let mut column = Vec::with_capacity(n * rows);
        for joint in 0..n {
            let course = regressor.course(joint, number);
            if course.is_empty() {
                column.resize(column.len() + rows, 0.0)
            } else {
                column.extend_from_slice(course)
            }
        }
        column
    };
    let mut columns: Vec<(usize, Vec<f64>)> = (0..INERTIAL_NUMBERS * n)
        .map(|number| (number, stacked(number)))
        .collect();
    let size = |column: &[f64]| square(column).sqrt();
    let largest = columns
        .iter()
        .map(|(_, column)| size(column))
        .fold(0.0, f64::max);
    columns.retain(|(_, column)| size(column) > IDLE * largest);
    for (_, column) in &mut columns {
        let scale = size(column);
        column.iter_mut().for_each(|value| *value /= scale);
    }
    let mut kept = Vec::new();
    // Modified Gram-Schmidt, largest remainder first: the diagonal of R falls as in Householder's.
    while let Some(next) =
        (0..columns.len()).max_by(|a, b| size(&columns[*a].1).total_cmp(&size(&columns[*b].1)))
    {
        let (number, mut direction) = columns.swap_remove(next);
        let left = size(&direction);
        if left <= DEPENDENT {
            break;
        }
        direction.iter_mut().for_each(|value| *value /= left);
        for (_, column) in &mut columns {
            let share: f64 = column.iter().zip(&direction).map(|(a, b)| a * b).sum();
            add(column, -share, &direction);
        }
        kept.push(number);
    }
    kept.sort_unstable();
    kept
}

/// Base columns, then those of all forms, form after form.
#[derive(Default)]
pub(super) struct TorqueColumns {
    pub(crate) columns: Vec<TorqueColumn>,
    /// Number of base columns.
    pub(crate) base: usize,
    /// Link and change of its numbers per coefficient of the base.
    pub(crate) base_changes: InertialChanges,
    /// 1 / variance beforehand of each coefficient.
    pub(crate) prior: Vec<f64>,
    pub(crate) forms: Vec<TorqueForm>,
    /// Forms that causes list; later ones are trials of a refinement.
    pub(crate) listed: usize,
    /// First column of each form.
    first: Vec<usize>,
    /// Nm, half the range of each joint's torque.
    torque: Vec<f64>,
}

/// 1 / variance, over the squared size of its column, of a coefficient of which nothing is known.
const UNKNOWN_BEFOREHAND: f64 = 1e-9;

impl TorqueColumns {
    /// The base alone; `torque` is half the range of each joint's torque, Nm.
    pub(crate) fn of_base(
        scene: &DynamicScene,
        regressor: &ReducedRegressor,
        torque: Vec<f64>,
    ) -> Self {
        let (base_changes, columns, prior) = base_columns(scene, regressor);
        Self {
            base: columns.len(),
            base_changes,
            columns,
            prior,
            torque,
            ..Self::default()
        }
    }

    /// Takes a further column of the base, before any form; whose coefficient is held at 0 until something is known of it beforehand.
    pub(crate) fn take_held(&mut self, column: TorqueColumn) {
        self.columns.push(column);
        self.prior.push(f64::INFINITY);
        self.base = self.columns.len();
    }

    /// Columns of a form by those of one at another joint, where they are alike.
    pub(crate) fn alike(&self, form: &TorqueForm) -> Option<Vec<TorqueColumn>> {
        let known = self.forms.iter().position(|known| {
            form.cause.alike_at_joints && known.name() == form.name() && known.with == form.with
        })?;
        let here = |column: &TorqueColumn| TorqueColumn {
            joints: vec![form.joint()],
            ..column.clone()
        };
        Some(self.columns[self.of(known)].iter().map(here).collect())
    }

    /// Takes a form with its columns; its number.
    pub(crate) fn take(&mut self, form: TorqueForm, columns: Vec<TorqueColumn>) -> usize {
        self.first.push(self.columns.len());
        self.prior.resize(self.columns.len(), 0.0);
        let prior: Vec<f64> = columns
            .iter()
            .map(|column| self.friction_prior(&form, column))
            .collect();
        self.prior.extend(prior);
        self.columns.extend(columns);
        self.forms.push(form);
        self.forms.len() - 1
    }

    /// 1 / variance beforehand of a coefficient: a law of friction alone is hardly more than the whole torque of its joint, so that two of them
    /// do not cancel each other.
    fn friction_prior(&self, form: &TorqueForm, column: &TorqueColumn) -> f64 {
        let about = form.cause;
        let Some(most) = self
            .torque
            .get(form.joint())
            .filter(|_| about.of_sign || about.brakes)
        else {
            return 0.0;
        };
        (largest(column.courses.iter().flatten()) / (*FRICTION * most).max(f64::MIN_POSITIVE))
            .powi(2)
    }

    /// Forgets forms from a number on.
    pub(crate) fn forget(&mut self, from: usize) {
        let columns = self.first.get(from).copied();
        let columns = columns.unwrap_or(self.columns.len());
        self.forms.truncate(from);
        self.first.truncate(from);
        self.columns.truncate(columns);
        self.prior.truncate(columns);
    }

    /// Takes other columns for a form.
    pub(crate) fn replace(&mut self, form: usize, columns: &[TorqueColumn]) {
        let range = self.of(form);
        self.columns[range].clone_from_slice(columns);
    }

    /// Takes a column of no form; its number.
    pub(crate) fn push_bare(&mut self, column: TorqueColumn) -> usize {
        self.columns.push(column);
        self.prior.resize(self.columns.len(), 0.0);
        self.columns.len() - 1
    }

    /// Rms of a column over half the range of the torque, over the joints that it acts on.
    pub(crate) fn size(&self, column: usize) -> f64 {
        let range = |joint: usize| self.torque.get(joint).copied().unwrap_or(1.0);
        self.rms(column, |joint| range(joint).max(f64::MIN_POSITIVE))
    }

    /// Rms of a column, Nm per unit of its coefficient, over the joints that it acts on.
    pub(crate) fn newton_metres(&self, column: usize) -> f64 {
        self.rms(column, |_| 1.0)
    }

    fn rms(&self, column: usize, unit: impl Fn(usize) -> f64) -> f64 {
        let TorqueColumn { joints, courses } = &self.columns[column];
        let of_joint = |(joint, course): (&usize, &Vec<f64>)| {
            let unit = unit(*joint);
            let squares = course.iter().map(|value| (value / unit).powi(2));
            squares.sum::<f64>() / course.len().max(1) as f64
        };
        let squares = joints.iter().zip(courses).map(of_joint);
        (squares.sum::<f64>() / joints.len().max(1) as f64).sqrt()
    }

    /// Columns of the base and of some forms.
    pub(crate) fn with_base(&self, forms: &[usize]) -> Vec<usize> {
        let of_forms = forms.iter().flat_map(|form| self.of(*form));
        (0..self.base).chain(of_forms).collect()
    }

    /// Columns of a form.
    pub(crate) fn of(&self, form: usize) -> std::ops::Range<usize> {
        self.first[form]..self.first[form] + self.forms[form].width
    }
}

/// A form's columns.
pub(super) fn columns_of(
    form: &TorqueForm,
    scene: &DynamicScene,
    reduction: &Reduction,
    regressor: &ReducedRegressor,
) -> Vec<TorqueColumn> {
    if let Some(changes) = form.inertial(scene) {
        return regressor.columns(&changes);
    }
    let joints = form.acts_on(scene.joints());
    let written = |(number, joint): (usize, usize)| {
        let mut whole = vec![0.0; scene.rows()];
        form.write(scene, joint, number, &mut whole);
        whole
    };
    let places =
        (0..form.width).flat_map(|number| joints.iter().map(move |joint| (number, *joint)));
    let mut courses = reduction.reduce(places.map(written).collect()).into_iter();
    let column = |_| TorqueColumn {
        courses: courses.by_ref().take(joints.len()).collect(),
        joints: joints.clone(),
    };
    (0..form.width).map(column).collect()
}

/// Changes of links' numbers with their columns and 1 / variance beforehand.
type Base = (InertialChanges, Vec<TorqueColumn>, Vec<f64>);

/// One standard deviation of each declared number, or the base parameters where none are declared.
fn base_columns(scene: &DynamicScene, regressor: &ReducedRegressor) -> Base {
    let changes: InertialChanges = match &scene.declared {
        Some(declared) => {
            let links = declared.tolerance.iter().enumerate();
            links
                .flat_map(|(link, all)| all.iter().map(move |ten| (link, *ten)))
                .collect()
        }
        // Another simulation has its masses.
        None if scene.beyond.is_some() => Vec::new(),
        None => {
            let base = base_parameters(regressor).into_iter();
            base.map(|number| (number / INERTIAL_NUMBERS, unit_number(number)))
                .collect()
        }
    };
    let columns = regressor.columns(&changes);
    let of_column = |column: &TorqueColumn| match scene.declared {
        Some(_) => 1.0,
        None => {
            let values = column.courses.iter().flatten();
            UNKNOWN_BEFOREHAND * values.map(|value| value * value).sum::<f64>()
        }
    };
    let prior = columns.iter().map(of_column).collect();
    (changes, columns, prior)
}

#[cfg(test)]
mod tests {
    use super::super::cases::bare_arm;
    use super::super::recording::TorqueRecording;
    use super::*;
    use nalgebra::Vector3;

    /// Base parameters of six turning joints that have nothing in common, the first one along `first`.
    fn count(first: Vector3<f64>) -> usize {
        let axes = [
            [0.2, -1.0, 0.3],
            [0.1, -0.9, 0.5],
            [1.0, 0.2, -0.4],
            [0.3, 1.0, 0.6],
            [0.9, -0.1, 0.7],
        ];
        let axes = [first.into()].into_iter().chain(axes);
        let point = |joint: usize| {
            let [far, aside] = [joint as f64, (joint % 3) as f64];
            [0.3 * far, 0.1 * aside, 0.4 - 0.05 * far]
        };
        let arm = bare_arm(axes, (0..6).map(point), [2.0, 0.0, 0.3]);
        let rows = 1500;
        let angle = |row: usize, joint: usize| {
            let (time, pace) = (row as f64 / 100.0, 1.0 + 0.37 * joint as f64);
            0.8 * (pace * time + joint as f64).sin() + 0.4 * (1.9 * pace * time).cos()
        };
        let recording = TorqueRecording::of_motion(
            6,
            (0..rows).map(|row| row as f64 / 100.0).collect(),
            (0..6 * rows).map(|k| angle(k / 6, k % 6)).collect(),
        );
        let clock = RecordingClock::of(&recording);
        let scene = DynamicScene::new(&arm, &recording, &clock, 10.0, true);
        base_parameters(&ReducedRegressor::of(&scene, &Reduction::new(&clock, 10.0))).len()
    }

    #[test]
    fn a_general_arm_of_six_turning_joints_has_38_base_parameters_of_60() {
        // Gautier & Khalil: 7 a joint, 3 of the first; 1 of it where its axis is along gravity.
        assert_eq!(count(Vector3::new(0.3, 0.5, 1.0)), 38);
        assert_eq!(count(Vector3::z()), 36);
    }
}
