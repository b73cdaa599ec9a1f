//! Columns of an orientation, in the convention that the file has, and the rotation vector that they make.

use super::layout::ColumnRef;
use crate::spatial::Pose;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Columns of the target's orientation in the tracker's frame, in one of four conventions.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OrientationColumns {
    /// Columns of w, x, y, z of a unit quaternion; no unit.
    pub quaternion: Option<Vec<ColumnRef>>,
    /// Columns of roll (about x), pitch (y), yaw (z) about fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll).
    pub rpy: Option<Vec<ColumnRef>>,
    /// Columns of angles about x, then the turned y, then the turned z (R = Rx Ry Rz), as many trackers write Rx, Ry, Rz.
    pub euler_xyz: Option<Vec<ColumnRef>>,
    /// Columns of x, y, z of the rotation vector: the axis times the angle.
    pub rotation_vector: Option<Vec<ColumnRef>>,
    /// Unit of the angles, e.g. `deg`.
    pub unit: Option<String>,
    /// The cells may be blank: the row has no orientation.
    pub optional: bool,
}

/// How the numbers of a row are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Convention {
    Quaternion,
    Rpy,
    EulerXyz,
    RotationVector,
}

/// A quaternion whose length differs from 1 by more than this is none: rounding to three digits is allowed.
const UNIT: f64 = 2e-3;

impl OrientationColumns {
    /// The convention with its columns; none unless exactly one is given.
    pub(super) fn columns(&self) -> Option<(Convention, &[ColumnRef])> {
        let given = [
            (Convention::Quaternion, &self.quaternion),
            (Convention::Rpy, &self.rpy),
            (Convention::EulerXyz, &self.euler_xyz),
            (Convention::RotationVector, &self.rotation_vector),
        ];
        let mut given = given.into_iter().filter_map(|(convention, columns)| Some((convention, columns.as_deref()?)));
        given.next().filter(|_| given.next().is_none())
    }
}

impl Convention {
    pub(super) fn numbers(self) -> usize {
        if self == Self::Quaternion { 4 } else { 3 }
    }

    /// The rotation vector (rad) of a row's numbers (rad; NaN where blank); NaN without any. Fails with what is wrong.
    pub(super) fn rotation_vector(self, numbers: [f64; 4]) -> Result<[f64; 3], String> {
        let [a, b, c, d] = numbers;
        let own = &numbers[..self.numbers()];
        if own.iter().all(|number| number.is_nan()) {
            return Ok([f64::NAN; 3]);
        }
        if own.iter().any(|number| number.is_nan()) {
            return Err("the orientation is incomplete".into());
        }
        let rotation = match self {
            Self::Quaternion => {
                let quaternion = Quaternion::new(a, b, c, d);
                let length = quaternion.norm();
                if (length - 1.0).abs() > UNIT {
                    return Err(format!("the quaternion has length {length:.4}; allowed: 1"));
                }
                UnitQuaternion::from_quaternion(quaternion)
            }
            Self::Rpy => UnitQuaternion::from_euler_angles(a, b, c),
            Self::EulerXyz => {
                let about = |axis: Vector3<f64>, angle: f64| UnitQuaternion::from_scaled_axis(axis * angle);
                about(Vector3::x(), a) * about(Vector3::y(), b) * about(Vector3::z(), c)
            }
            Self::RotationVector => UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)),
        };
        let rotation = Rotation3::from(rotation).into_inner();
        Ok(Pose::new(rotation, Vector3::zeros()).rotation_vector().into())
    }
}
