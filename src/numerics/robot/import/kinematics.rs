//! What calib's robot file itself may describe an arm by: joint screws, and Denavit-Hartenberg tables.

use super::place::DocumentNode;
use super::{ChainJoint, FrameChain};
use crate::description::JointKind;
use crate::robot::Bound;
use crate::units::Unit;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A direction shorter than this carries no direction; a pitch larger than this, per unit of the screw's size, is not rounding.
const SMALL: f64 = 1e-9;

const MOVING: &[(&str, JointKind)] = &[
    ("revolute", JointKind::Revolute),
    ("prismatic", JointKind::Prismatic),
];

/// Joint screws: an axis and a point on it, or a twist (v; w) with v = -w x point (Lynch & Park, Modern Robotics, 4.1).
pub(super) fn screws(screws: &DocumentNode, length: Unit) -> FrameChain {
    let joints = screws
        .items()
        .into_iter()
        .map(|screw| joint(screw, length))
        .collect();
    FrameChain {
        joints,
        tip: Isometry3::identity(),
        notes: Vec::new(),
    }
}

fn joint(screw: DocumentNode, length: Unit) -> ChainJoint {
    let screw = screw.map(&["kind", "axis", "point", "twist"]);
    let kind = screw.opt("kind").and_then(|kind| kind.choice(MOVING));
    let (kind, axis, point) = match screw.opt("twist") {
        Some(twist) => {
            if screw.opt("axis").is_some() || screw.opt("point").is_some() {
                screw.fault("has both `twist` and `axis`/`point`; expected one of the two forms");
            }
            let (of_twist, axis, point) = from_twist(&twist, length);
            if kind.is_some_and(|kind| kind != of_twist) {
                twist.fault("contradicts `kind`: a revolute twist (v; w) has w other than 0, a prismatic one has w = 0");
            }
            (of_twist, axis, point)
        }
        None => {
            let kind = kind.unwrap_or(JointKind::Revolute);
            let point = screw.get("point");
            // The place of a prismatic axis changes nothing.
            let unread = kind == JointKind::Prismatic && point.given().is_none();
            let point = if unread {
                [0.0; 3]
            } else {
                point.sized_vector(Bound::Length, length)
            };
            (kind, direction(&screw.get("axis")), Point3::from(point))
        }
    };
    ChainJoint::new(kind, axis, point)
}

/// A direction of any length but zero, as a unit vector.
pub(super) fn direction(value: &DocumentNode) -> Vector3<f64> {
    unit(Vector3::from(value.vector::<3>())).unwrap_or_else(|| {
        value.fault("has no direction: its length is zero");
        Vector3::repeat(f64::NAN)
    })
}

/// The vector with the length 1, also where the square of its length is beyond any number; none of no direction.
pub(super) fn unit(vector: Vector3<f64>) -> Option<Vector3<f64>> {
    // Not a number is not zero: its fault was noted when it was read.
    if vector.iter().any(|x| x.is_nan()) {
        return Some(vector);
    }
    let size = vector.amax();
    if size < SMALL {
        None
    } else {
        Some((vector / size).normalize())
    }
}

/// Kind, unit axis and the point of the axis nearest to the origin, m.
fn from_twist(value: &DocumentNode, length: Unit) -> (JointKind, Vector3<f64>, Point3<f64>) {
    let twist = value.sized_vector::<6>(Bound::Factor, Unit::One);
    let (v, w) = (
        Vector3::new(twist[0], twist[1], twist[2]),
        Vector3::new(twist[3], twist[4], twist[5]),
    );
    if w.norm() < SMALL {
        if v.norm() < SMALL {
            value.fault("is no screw: all six numbers are zero");
        }
        return (JointKind::Prismatic, v.normalize(), Point3::origin());
    }
    let pitch = v.dot(&w) / w.norm_squared();
    if pitch.abs() > SMALL * (1.0 + v.norm() / w.norm()) {
        value.fault(format!("moves {pitch} along its axis per rad; expected a pure rotation, v perpendicular to w, or w = 0"));
    }
    let point = Point3::from(w.cross(&v) / w.norm_squared()).map(|x| length.to_si(x));
    if let Some(message) = point.iter().find_map(|x| Bound::Length.fault(*x)) {
        value.fault(format!("its axis is away from the base: {message}"));
    }
    (JointKind::Revolute, w.normalize(), point)
}

/// What a row may be; none: no joint.
const ROWS: &[(&str, Option<JointKind>)] = &[
    ("revolute", Some(JointKind::Revolute)),
    ("prismatic", Some(JointKind::Prismatic)),
    ("fixed", None),
];

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum DhConvention {
    Standard,
    Modified,
}

/// Denavit-Hartenberg tables. Standard: T = Rz(theta) Tz(d) Tx(a) Rx(alpha), joint i about z of frame i-1.
/// Modified (Craig, Introduction to Robotics, 3.4): T = Rx(alpha) Tx(a) Rz(theta) Tz(d), joint i about z of frame i; its row i
/// holds alpha(i-1) and a(i-1). `theta` of a revolute and `d` of a prismatic joint are the values at joint position zero. A row of
/// the kind `fixed` moves the frame and is no joint: a base, a track or a tool that the convention alone cannot place.
pub(super) fn dh(
    rows: &DocumentNode,
    convention: DhConvention,
    length: Unit,
    angle: Unit,
) -> FrameChain {
    let mut frame = Isometry3::identity();
    let mut joints = Vec::new();
    for row in rows.items() {
        let row = row.map(&["kind", "theta", "d", "a", "alpha"]);
        // What the joint itself moves is zero unless the file states it; all other elements are required.
        let kind = row
            .opt("kind")
            .and_then(|kind| kind.choice(ROWS))
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
            frame: Some(frame),
            ..ChainJoint::new(kind, at_joint * Vector3::z(), at_joint * Point3::origin())
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
