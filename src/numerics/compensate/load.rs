//! Whether an identified arm depends on what it carries, seen by placing it under two loads.

use super::{Chain, Circumstance, IdentifiedArm};
use crate::estimate::choose::spread;

/// Poses over which it is seen.
const POSES: usize = 30;

/// m: a smaller displacement by the load is of no account.
const MATTERS: f64 = 1e-6;

/// Whether a load of `heaviest` kg moves the tool of the arm, or turns it away, from where it is without one.
pub fn load_matters(arm: &IdentifiedArm, heaviest: f64) -> bool {
    let robot = &arm.model().robot;
    let poses = spread(robot, POSES);
    let bare = Circumstance::unknown(robot.joints());
    let loaded = Circumstance {
        payload: heaviest,
        ..bare.clone()
    };
    let mut reach = arm.reach();
    (0..poses.rows()).any(|row| {
        reach.under(&bare);
        let without = reach.place(poses.q(row));
        reach.under(&loaded);
        (reach.place(poses.q(row)).translation - without.translation).norm() > MATTERS
    })
}

/// Why targets without a payload are refused; `load`: the largest that was measured, kg.
pub fn unstated_payload(load: f64) -> String {
    format!(
        "states no payload, and the identified arm depends on it (measured up to {load} kg): give --payload KG, 0 where nothing is carried; a table may have a column payload_kg, a program tooldata or $LOAD"
    )
}
