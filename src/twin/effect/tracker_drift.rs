//! The tracker's stand creeps, and the base frame with it as the tracker sees it.

use super::{Act, Motion, State, by_axis, effect};
use crate::matrix::{self, Vector};
use crate::motion::step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The course of a creep over time, with `u = t / settling`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Course {
    /// `1 - exp(-u)`: slows down towards a final motion.
    #[default]
    Settling,
    /// `u`: never slows down.
    Linear,
    /// `sqrt(u)`: as heat creeps into a stand.
    Root,
}

effect! {
    /// A creep of the tracker's stand.
    pub struct TrackerDrift {
        /// Final displacement of what is measured, tracker frame, um.
        #[serde(default)]
        pub shift_um: Vector,
        /// Its final rotation vector about the tracker's origin, arcsec.
        #[serde(default)]
        pub turn_arcsec: Vector,
        /// Time constant, h; for the courses that do not settle, the time at which the motion is as stated.
        pub settling_h: f64,
        /// Over time.
        #[serde(default)]
        pub course: Course,
    }
    "tracker_drift" of "tracker" "tracker", scaled by shift_um turn_arcsec, |self| by_axis(self.shift_um, self.turn_arcsec)
}

impl Act for TrackerDrift {
    fn act(&self, state: &State, motion: &mut Motion) {
        let u = state.row.time_s / (3600.0 * self.settling_h);
        let share = match self.course {
            Course::Settling => 1.0 - (-u).exp(),
            Course::Linear => u,
            Course::Root => u.max(0.0).sqrt(),
        };
        let by = step(self.shift_um, self.turn_arcsec, share);
        motion.tracker = matrix::times(&by, &motion.tracker);
    }
}
