//! Moments of inertia of a body and how far declared masses may be off, as robot files state them.

use super::place::DocumentNode;
use crate::description::{InertiaMoments, MassTolerance};
use crate::robot::Bound;
use crate::units::Unit;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// A principal moment below this share of the largest is none.
const NONE: f64 = 1e-6;
/// By which share the largest principal moment may be above the sum of the others: numbers are written with two digits.
const ROUNDING: f64 = 0.01;

/// `[xx, xy, xz, yy, yz, zz]` of a file, kg m2, with a note where no body can have them.
pub(super) fn moments(value: DocumentNode) -> InertiaMoments {
    let moments = value.sized_vector::<6>(Bound::Inertia, Unit::KilogramSquareMetre);
    if let Some(message) = impossible_inertia(&moments) {
        value.note(message + UNUSED);
    }
    moments
}

/// What impossible moments are no hindrance for.
pub(super) const UNUSED: &str =
    "; positions do not depend on it, torques are not diagnosed with it";

/// Why no body has these moments, if so; a body without any moment is a point.
pub fn impossible_inertia(moments: &InertiaMoments) -> Option<String> {
    if moments.iter().any(|moment| !moment.is_finite())
        || moments.iter().all(|moment| *moment == 0.0)
    {
        return None;
    }
    let mut principal: [f64; 3] = tensor(moments).symmetric_eigenvalues().into();
    principal.sort_by(f64::total_cmp);
    let [least, middle, most] = principal;
    if least < NONE * most {
        let least = if least < -NONE * most.abs() {
            "negative"
        } else {
            "zero"
        };
        return Some(format!(
            "no body has a principal moment of inertia that is {least}; expected [xx, xy, xz, yy, yz, zz] about the centre"
        ));
    }
    (most > (1.0 + ROUNDING) * (least + middle)).then(|| {
        let times = most / (least + middle);
        format!(
            "no body has a principal moment of inertia of {times:.3} times the sum of the other two; expected at most that sum"
        )
    })
}

/// m from a link at which its centre may always be: a counterweight.
const COUNTERWEIGHT: f64 = 1.0;

/// Why a centre is none of its link, from its joint to the next, if so: it is farther away than the whole arm is long.
pub(super) fn outside_link(
    centre: &Vector3<f64>,
    link: usize,
    points: &[Vector3<f64>],
) -> Option<String> {
    let (from, to) = (points.get(link)?, points.get(link + 1)?);
    let lengths = points.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    let most = lengths.sum::<f64>().max(COUNTERWEIGHT);
    let along = to - from;
    let share = (centre - from).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
    let away = (centre - from - along * share.clamp(0.0, 1.0)).norm();
    (away > most).then(|| {
        format!(
            "{away:.3} m from its link, which reaches from its joint to the next; allowed: up to {most:.3} m, the length of the arm; is it in another \
             unit or frame?"
        )
    })
}

/// The symmetric tensor of six moments.
pub(super) fn tensor([xx, xy, xz, yy, yz, zz]: &InertiaMoments) -> Matrix3<f64> {
    Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
}

/// The six moments of a symmetric tensor.
pub(super) fn of_tensor(t: &Matrix3<f64>) -> InertiaMoments {
    [
        t[(0, 0)],
        t[(0, 1)],
        t[(0, 2)],
        t[(1, 1)],
        t[(1, 2)],
        t[(2, 2)],
    ]
}

/// The moments in the axes that `rotation` turns the body's own into.
pub(super) fn turned(moments: &InertiaMoments, rotation: &Rotation3<f64>) -> InertiaMoments {
    of_tensor(&(rotation.matrix() * tensor(moments) * rotation.matrix().transpose()))
}

/// The tensor of a point mass at `arm` from a centre: what moving the axes adds.
pub(super) fn offset(mass: f64, arm: &Vector3<f64>) -> Matrix3<f64> {
    mass * (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose())
}

/// One standard deviation of declared masses, by three keys; the centre in `length`.
pub(super) fn tolerance(value: DocumentNode, keys: [&str; 3], length: Unit) -> MassTolerance {
    let value = value.map(&keys);
    let above = |key: &str, unit: Unit, bound: Bound| {
        let value = value.get(key);
        let number = value.sized(bound, unit);
        if number <= 0.0 {
            value.fault(format!("expected a number above 0, found {number}"));
        }
        number
    };
    MassTolerance {
        mass: above(keys[0], Unit::One, Bound::Factor),
        centre: above(keys[1], length, Bound::Length),
        inertia: above(keys[2], Unit::One, Bound::Factor),
    }
}
