//! Frames of links as others chose them, moved as little as the corrected axes demand: meshes and origins stay where they were.

use crate::description::{JointDescription, JointKind};
use crate::spatial::Pose;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// A joint's frame, whose axis is `nominal` in the base frame, on the corrected axis: turned from the one axis to the other, its origin at
/// the point nearest to where it was.
pub(super) fn moved(frame: &Pose, nominal: &Vector3<f64>, corrected: &JointDescription) -> Pose {
    let axis = Vector3::from(corrected.axis);
    // By the arc tangent: an arc cosine near 1 loses half of the digits.
    let normal = nominal.cross(&axis);
    let sine = normal.norm();
    let turn = if sine > 0.0 {
        Rotation3::new(normal * (sine.atan2(nominal.dot(&axis)) / sine))
    } else {
        Rotation3::identity()
    };
    let point = Vector3::from(corrected.point);
    let origin = match corrected.kind {
        JointKind::Revolute => point + axis * axis.dot(&(frame.translation - point)),
        JointKind::Prismatic => frame.translation,
    };
    Pose::new(turn.into_inner() * frame.rotation, origin)
}

/// Place and turn of a frame seen from another as URDF writes them: m, and roll, pitch and yaw, rad.
pub(super) fn origin(from: &Pose, to: &Pose) -> ([f64; 3], [f64; 3]) {
    let between = from.inverse() * *to;
    let (roll, pitch, yaw) = Rotation3::from_matrix_unchecked(between.rotation).euler_angles();
    (between.translation.into(), [roll, pitch, yaw])
}

/// The pose of a tool: its rotation by rows, and its point.
pub(super) fn tool(point: [f64; 3], rows: &[[f64; 3]; 3]) -> Pose {
    Pose::new(Matrix3::from_fn(|i, k| rows[i][k]), point.into())
}
