//! Evidence outside the model that a point is wrong: the same target in the same pose lies elsewhere, or it is farther off than an arm can be.
//!
//! A row that no model was fitted to judges the model; the model's own failure there is no evidence against the row.

use crate::robot::Measurements;
use nalgebra::Vector3;

/// Two measurements of one target in one pose that are this many times their noise apart: one of them is wrong.
const DISAGREES: f64 = 10.0;
/// Repeats of a pose scatter by less than this, whatever the joints do, m.
const JOINTS: f64 = 0.5e-3;
/// No joint, gear or tool that still moves puts a point so far off, m.
const IMPOSSIBLE: f64 = 20e-3;

/// Whether more than the model speaks against a row that is `off` by so much, m.
pub(super) fn is_wrong(data: &Measurements, row: usize, off: f64) -> bool {
    if off > IMPOSSIBLE {
        return true;
    }
    let Some(point) = data.point(row) else { return false };
    let again = |other: &usize| *other != row && data.target(*other) == data.target(row) && data.same_pose(row, *other);
    let mut repeats = (0..data.rows()).filter(again).filter_map(|other| Some((other, data.point(other)?))).peekable();
    let apart = |(other, measured): (usize, Vector3<f64>)| {
        let noise = data.noise(row).hypot(data.noise(other));
        (point - measured).norm() > (DISAGREES * noise).max(JOINTS)
    };
    repeats.peek().is_some() && repeats.all(apart)
}
