//! Evidence outside the model that a point is wrong: the same target in the same pose lies elsewhere, or it is farther off than an arm can be.
//!
//! A row that no model was fitted to judges the model; the model's own failure there is no evidence against the row.

use crate::criteria::screen::{DISAGREES, IMPOSSIBLE, JOINTS};
use crate::robot::Measurements;

/// Whether more than the model speaks against a row that is `off` by so much, m.
pub(super) fn is_wrong(data: &Measurements, row: usize, off: f64) -> bool {
    if off > *IMPOSSIBLE {
        return true;
    }
    let again = |other: &usize| *other != row && data.whole(*other) && data.target(*other) == data.target(row);
    let mut repeats = (0..data.rows()).filter(again).filter(|other| data.same_pose(row, *other)).peekable();
    let apart = |other: usize| {
        let noise = data.noise(row).hypot(data.noise(other));
        (data.position[row] - data.position[other]).norm() > (*DISAGREES * noise).max(*JOINTS)
    };
    data.whole(row) && repeats.peek().is_some() && repeats.all(apart)
}
