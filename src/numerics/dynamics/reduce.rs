//! From rows as recorded to judged rows: one low-pass, alike for measured torque and every column, then fewer rows; and the columns of the
//! regressor so.
//!
//! Base parameters: inertial numbers that torques can determine, by QR with column pivoting of the stacked regressor (Gautier, 1991).

use crate::arm::INERTIAL_NUMBERS;
use crate::clock::RecordingClock;
use crate::filter::ZeroPhase;
use crate::newton_euler::InverseDynamics;
use crate::scene::{DynamicScene, split};
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
            let mut slices: Vec<&mut [f64]> = courses
                .iter_mut()
                .map(|course| &mut course[stretch.clone()])
                .collect();
            self.filter.apply(&mut slices);
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
#[derive(Debug, Clone)]
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
            let sums = torques[*joint].iter_mut().zip(course);
            sums.for_each(|(sum, part)| *sum += coefficient * part);
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
            for (course, share) in sensitivities
                .iter()
                .zip(ten)
                .filter(|(_, share)| **share != 0.0)
            {
                sum.iter_mut()
                    .zip(course)
                    .for_each(|(sum, value)| *sum += share * value);
            }
            sum
        };
        TorqueColumn {
            courses: joints.iter().map(course).collect(),
            joints,
        }
    }

    /// Torque of 10 n numbers at a joint.
    pub(crate) fn torque(&self, joint: usize, theta: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.0[joint].last().map_or(0, Vec::len)];
        for (course, share) in self.0[joint]
            .iter()
            .zip(theta)
            .skip(INERTIAL_NUMBERS * joint)
        {
            sum.iter_mut()
                .zip(course)
                .for_each(|(sum, value)| *sum += share * value);
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
    let size = |column: &[f64]| column.iter().map(|value| value * value).sum::<f64>().sqrt();
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
            column
                .iter_mut()
                .zip(&direction)
                .for_each(|(value, along)| *value -= share * along);
        }
        kept.push(number);
    }
    kept.sort_unstable();
    kept
}

#[cfg(test)]
mod tests {
    use super::super::arm::{DynamicArm, InertialTolerance};
    use super::super::clock::RecordingClock;
    use super::super::reduce::Reduction;
    use super::super::scene::DynamicScene;
    use super::*;
    use crate::types::TorqueRecording;
    use nalgebra::{Point3, Vector3};

    /// Base parameters of six turning joints that have nothing in common, the first one along `first`.
    fn count(first: Vector3<f64>) -> usize {
        let axes = [
            [0.2, -1.0, 0.3],
            [0.1, -0.9, 0.5],
            [1.0, 0.2, -0.4],
            [0.3, 1.0, 0.6],
            [0.9, -0.1, 0.7],
        ];
        let arm = DynamicArm {
            axes: [first.normalize()]
                .into_iter()
                .chain(axes.map(|axis| Vector3::from(axis).normalize()))
                .collect(),
            points: (0..6)
                .map(|joint| {
                    Point3::new(
                        0.3 * f64::from(joint),
                        0.1 * f64::from(joint % 3),
                        0.4 - 0.05 * f64::from(joint),
                    )
                })
                .collect(),
            prismatic: vec![false; 6],
            tool: Point3::new(2.0, 0.0, 0.3),
            links: None,
            payload: None,
            gravity: Vector3::new(0.0, 0.0, -9.81),
            ratio: vec![100.0; 6],
            coupled: Vec::new(),
            tolerance: InertialTolerance {
                mass_relative: 0.01,
                centre: 0.001,
                inertia_relative: 0.05,
            },
        };
        let rows = 1500;
        let angle = |row: usize, joint: usize| {
            let (time, pace) = (row as f64 / 100.0, 1.0 + 0.37 * joint as f64);
            0.8 * (pace * time + joint as f64).sin() + 0.4 * (1.9 * pace * time).cos()
        };
        let recording = TorqueRecording {
            joints: 6,
            time: (0..rows).map(|row| row as f64 / 100.0).collect(),
            position: (0..rows)
                .flat_map(|row| (0..6).map(move |joint| angle(row, joint)))
                .collect(),
            velocity: None,
            torque: vec![0.0; 6 * rows],
            temperature: None,
            trajectory: vec![1; rows],
            held_out: vec![false; rows],
            from_current: false,
        };
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
