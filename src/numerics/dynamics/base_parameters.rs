//! Base parameters: inertial numbers that torques can determine, by QR with column pivoting of the stacked regressor (Gautier, 1991).

use super::arm::INERTIAL_NUMBERS;
use super::reduce::ReducedRegressor;

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
    use super::super::recording::TorqueRecording;
    use super::super::reduce::Reduction;
    use super::super::scene::DynamicScene;
    use super::*;
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
