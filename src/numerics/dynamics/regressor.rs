//! Judged rows of the regressor, filtered and decimated as measured torques are.

use super::newton_euler::{INERTIAL_NUMBERS, InverseDynamics};
use super::reduce::Reduction;
use super::scene::{DynamicScene, split};

/// What a coefficient changes: courses of judged rows at some joints.
#[derive(Debug, Clone)]
pub(super) struct TorqueColumn {
    /// Ascending, from 0.
    pub joints: Vec<usize>,
    /// One a joint.
    pub courses: Vec<Vec<f64>>,
}

impl TorqueColumn {
    /// Adds it with a coefficient to torques, `[joint][judged row]`.
    pub fn add(&self, coefficient: f64, torques: &mut [Vec<f64>]) {
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
    pub fn of(scene: &DynamicScene, reduction: &Reduction) -> Self {
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
        let of = |joint: usize| {
            let before = (0..INERTIAL_NUMBERS * joint).map(|_| Vec::new());
            before
                .chain(courses.by_ref().take(INERTIAL_NUMBERS * (n - joint)))
                .collect()
        };
        Self((0..n).map(of).collect())
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.0.len()
    }

    /// Course of one number at a joint; empty where the link is before the joint.
    pub fn course(&self, joint: usize, number: usize) -> &[f64] {
        &self.0[joint][number]
    }

    /// The column of a change of a link's ten numbers.
    pub fn column(&self, link: usize, ten: &[f64; INERTIAL_NUMBERS]) -> TorqueColumn {
        let joints: Vec<usize> = (0..=link).collect();
        let course = |joint: &usize| {
            let own = &self.0[*joint][INERTIAL_NUMBERS * link..INERTIAL_NUMBERS * (link + 1)];
            let mut sum = vec![0.0; own[0].len()];
            for (course, share) in own.iter().zip(ten).filter(|(_, share)| **share != 0.0) {
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
    pub fn torque(&self, joint: usize, theta: &[f64]) -> Vec<f64> {
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
