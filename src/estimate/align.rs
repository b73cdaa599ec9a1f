//! The base pose that puts the nominal robot on the measured points: Kabsch's solution, with far points trimmed.

use crate::robot::{Measurements, RobotModel};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Vector3};

/// Rows farther off than this many medians take no part in the alignment.
const TRIM: f64 = 4.0;

/// Returns the pose of the base in the tracker's frame, from `rows` of the recording. Fewer than three points give the identity.
pub fn align(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Pose {
    if rows.len() < 3 {
        return Pose::identity();
    }
    let model: Vec<Vector3<f64>> = rows.iter().map(|row| robot.forward(data.q(*row)).translation).collect();
    let measured: Vec<Vector3<f64>> = rows.iter().map(|row| data.position[*row]).collect();
    let mut used: Vec<usize> = (0..rows.len()).collect();
    let mut pose = kabsch(&model, &measured, &used);
    for _ in 0..10 {
        let errors: Vec<f64> = model.iter().zip(&measured).map(|(a, b)| (pose.point(a) - b).norm()).collect();
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        let limit = TRIM * sorted[sorted.len() / 2];
        let next: Vec<usize> = (0..rows.len()).filter(|i| errors[*i] <= limit).collect();
        if next == used {
            break;
        }
        used = next;
        pose = kabsch(&model, &measured, &used);
    }
    pose
}

fn kabsch(from: &[Vector3<f64>], to: &[Vector3<f64>], used: &[usize]) -> Pose {
    let count = used.len() as f64;
    let centre = |points: &[Vector3<f64>]| used.iter().map(|i| points[*i]).sum::<Vector3<f64>>() / count;
    let (a, b) = (centre(from), centre(to));
    let covariance: Matrix3<f64> = used.iter().map(|i| (to[*i] - b) * (from[*i] - a).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Pose::identity() };
    let mut sign = Matrix3::identity();
    // Without this a mirrored solution could win.
    sign[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = u * sign * v_t;
    Pose::new(rotation, b - rotation * a)
}
