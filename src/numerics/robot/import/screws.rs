//! Joint screws: an axis and a point on it, or a twist (v; w) with v = -w x point (Lynch & Park, Modern Robotics, 4.1).

use super::place::DocumentNode;
use super::{ChainJoint, FrameChain};
use crate::description::JointKind;
use crate::robot::Bound;
use crate::units::Unit;
use nalgebra::{Isometry3, Point3, Vector3};

// A direction shorter than this carries no direction; a pitch larger than this, per unit of the screw's size, is not rounding.
const SMALL: f64 = 1e-9;

const KINDS: &[(&str, JointKind)] = &[
    ("revolute", JointKind::Revolute),
    ("prismatic", JointKind::Prismatic),
];

pub(super) fn read(screws: &DocumentNode, length: Unit) -> FrameChain {
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
    let kind = screw
        .get("kind")
        .given()
        .and_then(|kind| kind.choice(KINDS));
    let (kind, axis, point) = match screw.get("twist").given() {
        Some(twist) => {
            if screw.get("axis").given().is_some() || screw.get("point").given().is_some() {
                screw.fault("has both `twist` and `axis`/`point`; expected one of the two forms");
            }
            let (of_twist, axis, point) = from_twist(twist, length);
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
    ChainJoint {
        name: None,
        kind,
        axis,
        point,
        limits: None,
        frame: None,
        body: None,
    }
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
