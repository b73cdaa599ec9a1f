//! Evidence outside the model that a point is wrong: the same target in the same pose lies elsewhere, or it is farther off than an arm can be.
//!
//! A row that no model was fitted to judges the model; the model's own failure there is no evidence against the row.

use crate::criteria::screen::{DISAGREES, IMPOSSIBLE, JOINTS};
use crate::robot::Measurements;
use nalgebra::Vector3;

/// Whether more than the model speaks against a row that is `off` by so much, m.
pub(super) fn is_wrong(data: &Measurements, row: usize, off: f64) -> bool {
    if off > *IMPOSSIBLE {
        return true;
    }
    let Some(point) = data.point(row) else {
        return false;
    };
    let again = |other: &usize| {
        *other != row && data.target(*other) == data.target(row) && data.same_pose(row, *other)
    };
    let mut repeats = (0..data.rows())
        .filter(again)
        .filter_map(|other| Some((other, data.point(other)?)))
        .peekable();
    let apart = |(other, measured): (usize, Vector3<f64>)| {
        let noise = data.noise(row).hypot(data.noise(other));
        (point - measured).norm() > (*DISAGREES * noise).max(*JOINTS)
    };
    repeats.peek().is_some() && repeats.all(apart)
}
