//! Denavit-Hartenberg tables. Standard: T = Rz(theta) Tz(d) Tx(a) Rx(alpha), joint i about z of frame i-1.
//! Modified (Craig, Introduction to Robotics, 3.4): T = Rx(alpha) Tx(a) Rz(theta) Tz(d), joint i about z of frame i; its row i
//! holds alpha(i-1) and a(i-1). `theta` of a revolute and `d` of a prismatic joint are the values at joint position zero. A row of
//! the kind `fixed` moves the frame and is no joint: a base, a track or a tool that the convention alone cannot place.

use super::place::DocumentNode;
use super::{ChainJoint, FrameChain};
use crate::description::JointKind;
use crate::robot::Bound;
use crate::units::Unit;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// What a row may be; none: no joint.
const KINDS: &[(&str, Option<JointKind>)] = &[
    ("revolute", Some(JointKind::Revolute)),
    ("prismatic", Some(JointKind::Prismatic)),
    ("fixed", None),
];

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum DhConvention {
    Standard,
    Modified,
}

pub(super) fn read(
    rows: &DocumentNode,
    convention: DhConvention,
    length: Unit,
    angle: Unit,
) -> FrameChain {
    let mut frame = Isometry3::identity();
    let mut joints = Vec::new();
    for row in rows.items() {
        let row = row.map(&["kind", "theta", "d", "a", "alpha"]);
        // What the joint itself moves is zero unless said otherwise; the rest has to be there.
        let kind = row
            .get("kind")
            .given()
            .and_then(|kind| kind.choice(KINDS))
            .unwrap_or(Some(JointKind::Revolute));
        let moved = match kind {
            Some(JointKind::Revolute) => "theta",
            Some(JointKind::Prismatic) => "d",
            None => "",
        };
        let number = |key: &str, bound: Bound, unit: Unit| {
            let value = row.get(key);
            if key == moved && value.given().is_none() {
                0.0
            } else {
                value.sized(bound, unit)
            }
        };
        let (turn, along) = (
            |key: &str| number(key, Bound::Angle, angle),
            |key: &str| number(key, Bound::Length, length),
        );
        let about_z =
            rotation(Vector3::z(), turn("theta")) * shift(0.0, number("d", Bound::Offset, length));
        let about_x = rotation(Vector3::x(), turn("alpha")) * shift(along("a"), 0.0);
        let at_joint = if convention == DhConvention::Standard {
            frame
        } else {
            frame * about_x
        };
        frame = match convention {
            DhConvention::Standard => frame * about_z * about_x,
            DhConvention::Modified => at_joint * about_z,
        };
        let Some(kind) = kind else { continue };
        joints.push(ChainJoint {
            name: None,
            kind,
            axis: at_joint * Vector3::z(),
            point: at_joint * Point3::origin(),
            limits: None,
            frame: Some(frame),
            body: None,
        });
    }
    FrameChain {
        joints,
        tip: frame,
        notes: Vec::new(),
    }
}

fn rotation(axis: Vector3<f64>, angle: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::identity(),
        UnitQuaternion::from_scaled_axis(axis * angle),
    )
}

fn shift(along_x: f64, along_z: f64) -> Isometry3<f64> {
    Isometry3::translation(along_x, 0.0, along_z)
}
