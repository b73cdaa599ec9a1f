//! The tracker's stand swings slowly, as a tripod does in the sun or beside a machine: an effect that no list expects.

use super::{Act, Motion, State, effect};
use crate::matrix::{self, Vector};
use crate::motion::step;
use std::f64::consts::TAU;

effect! {
    /// A sine of time in one direction of motion of what is measured.
    pub struct TrackerSway {
        /// Displacement at the peak, tracker frame, um.
        #[serde(default)]
        pub shift_um: Vector,
        /// Rotation vector at the peak about the tracker's origin, arcsec.
        #[serde(default)]
        pub turn_arcsec: Vector,
        /// s.
        pub period_s: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
        /// Time in which the swing fades to 37 %, s; 0: never.
        #[serde(default)]
        pub fading_s: f64,
    }
    "unknown" of "tracker_sway" "tracker", scaled by shift_um turn_arcsec,
    |self| [("shift", "um", matrix::norm(self.shift_um)), ("turn", "arcsec", matrix::norm(self.turn_arcsec)), ("period", "s", self.period_s)]
}

impl Act for TrackerSway {
    fn act(&self, state: &State, motion: &mut Motion) {
        let time = state.row.time_s;
        let left = if self.fading_s > 0.0 {
            (-time / self.fading_s).exp()
        } else {
            1.0
        };
        let share = left * (TAU * time / self.period_s + self.phase_deg.to_radians()).sin();
        let by = step(self.shift_um, self.turn_arcsec, share);
        motion.tracker = matrix::times(&by, &motion.tracker);
    }
}
