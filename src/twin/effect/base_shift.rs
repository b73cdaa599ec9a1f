//! The base steps on its foundation at some time: a collision, a loosened anchor.

use super::{Act, Motion, State, by_axis, effect};
use crate::matrix::{self, Vector};
use crate::motion::step;

effect! {
    /// A rigid step of the base from a moment on.
    pub struct BaseShift {
        /// Displacement, base frame, um.
        #[serde(default)]
        pub shift_um: Vector,
        /// Rotation vector about the base's origin, arcsec.
        #[serde(default)]
        pub turn_arcsec: Vector,
        /// The moment since the start of the recording, s.
        pub at_s: f64,
    }
    "base_shift" of "base" "base", scaled by shift_um turn_arcsec,
    |self| by_axis(self.shift_um, self.turn_arcsec).chain([("at", "s", self.at_s)])
}

impl Act for BaseShift {
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            let by = step(self.shift_um, self.turn_arcsec, 1.0);
            motion.base = matrix::times(&by, &motion.base);
        }
    }
}
