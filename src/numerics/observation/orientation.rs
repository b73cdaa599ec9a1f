//! Orientations: how a target is turned in the tracker's frame; kept as a rotation matrix, its residual is a rotation vector.

use super::{
    ColumnShape, Convention, Conventions, DeclaredColumn, Dimension, KindDescription,
    MeasurementKind, Part, Rank, RowView, Sensitivity, Weight,
};
use crate::robot::{Measurements, ONE_AND_A_HALF_TURNS};
use crate::spatial::Pose;
use crate::units::Quantity::Angle;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// The kind `orientation`.
#[derive(Debug, Clone, Copy)]
pub struct Orientation;

/// A quaternion whose length differs from 1 by more than this is none: rounding to three digits is allowed.
const UNIT: f64 = 2e-3;

static CONVENTIONS: Conventions = Conventions {
    name: "OrientationColumns",
    about: "Columns of the target's orientation in the tracker's frame, in one of four conventions.",
    unit: "Unit of the angles, e.g. `deg`.",
    allowed: "say `quaternion: [w, x, y, z]`, `rpy: [roll, pitch, yaw]`, `euler_xyz: [Rx, Ry, Rz]` or `rotation_vector: [x, y, z]`, one of them",
    all: &[
        Convention {
            name: "quaternion",
            about: "Columns of w, x, y, z of a unit quaternion; no unit.",
            numbers: 4,
            unitless: true,
            read: |n| {
                let quaternion = Quaternion::new(n[0], n[1], n[2], n[3]);
                let length = quaternion.norm();
                if (length - 1.0).abs() > UNIT {
                    return Err(format!("the quaternion has length {length:.4}; allowed: 1"));
                }
                Ok(vector(UnitQuaternion::from_quaternion(quaternion)))
            },
        },
        Convention {
            name: "rpy",
            about: "Columns of roll (about x), pitch (y), yaw (z) about fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll).",
            numbers: 3,
            unitless: false,
            read: |n| Ok(vector(UnitQuaternion::from_euler_angles(n[0], n[1], n[2]))),
        },
        Convention {
            name: "euler_xyz",
            about: "Columns of angles about x, then the turned y, then the turned z (R = Rx Ry Rz), as many trackers write Rx, Ry, Rz.",
            numbers: 3,
            unitless: false,
            read: |n| {
                let about = |axis: usize| {
                    UnitQuaternion::from_scaled_axis(Vector3::ith(axis, 1.0) * n[axis])
                };
                Ok(vector(about(0) * about(1) * about(2)))
            },
        },
        Convention {
            name: "rotation_vector",
            about: "Columns of x, y, z of the rotation vector: the axis times the angle.",
            numbers: 3,
            unitless: false,
            read: |n| {
                Ok(vector(UnitQuaternion::from_scaled_axis(Vector3::new(
                    n[0], n[1], n[2],
                ))))
            },
        },
    ],
};

fn vector(rotation: UnitQuaternion<f64>) -> [f64; 3] {
    Pose::new(Rotation3::from(rotation).into_inner(), Vector3::zeros())
        .rotation_vector()
        .into()
}

static ABOUT: KindDescription = KindDescription {
    name: "orientation",
    word: "rotation",
    dimension: Dimension::Angle,
    axes: 3,
    columns: &[
        DeclaredColumn {
            shape: ColumnShape::Conventions(&CONVENTIONS),
            ..DeclaredColumn::number(
                "orientation",
                &["rx", "ry", "rz"],
                Angle,
                [-ONE_AND_A_HALF_TURNS, ONE_AND_A_HALF_TURNS],
                "Orientation of the target in the tracker's frame.",
            )
            .as_part(Part::Value)
        },
        DeclaredColumn::number(
            "sigma_orientation",
            &["sigma_r"],
            Angle,
            [0.0, 1.0],
            "Standard deviation of the orientation about each axis.",
        )
        .as_part(Part::Sigma),
    ],
    own_sigma: true,
    rank: Rank {
        places: false,
        rotations: true,
        scale: true,
        blind: [3, 0],
    },
    is_screened: false,
};

impl Orientation {
    /// The measured rotation of a row and its standard deviation about each axis, rad.
    fn measured(&self, data: &Measurements, row: usize) -> Option<(Matrix3<f64>, f64)> {
        let reading = self.reading(data, row)?;
        Some((Matrix3::from_column_slice(reading.values), reading.sigma))
    }
}

impl MeasurementKind for Orientation {
    fn about(&self) -> &'static KindDescription {
        &ABOUT
    }

    fn residual(&self, at: RowView) -> Option<(Vector3<f64>, f64)> {
        let RowView { data, row, placed } = at;
        let (measured, sigma) = self.measured(data, row)?;
        let off = measured * placed.orientation().transpose();
        Some((
            Pose::new(off, Vector3::zeros()).rotation_vector(),
            sigma * sigma,
        ))
    }

    fn sensitivity(&self, _at: RowView, weight: Weight) -> Sensitivity {
        Sensitivity::Rotation(weight)
    }

    fn keep(&self, stored: &[f64], kept: &mut Vec<f64>) {
        let pose = Pose::from_rotation_vector(Vector3::from_column_slice(stored), Vector3::zeros());
        kept.extend(pose.rotation.iter());
    }

    fn attitude(
        &self,
        data: &Measurements,
        row: usize,
        body: &Matrix3<f64>,
    ) -> Option<Matrix3<f64>> {
        Some(body.tr_mul(&self.measured(data, row)?.0))
    }
}
