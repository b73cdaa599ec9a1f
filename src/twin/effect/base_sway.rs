//! The base swings slowly, as a floor does with a neighbour's machine or the sun: an effect that no list expects.

use super::{Act, Motion, State, effect};
use crate::matrix::{self, Vector};
use crate::motion::step;

effect! {
    /// A sine of time in one direction of motion of the base.
    pub struct BaseSway {
        /// Displacement at the peak, base frame, um.
        #[serde(default)]
        pub shift_um: Vector,
        /// Rotation vector at the peak, arcsec.
        #[serde(default)]
        pub turn_arcsec: Vector,
        /// s.
        pub period_s: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "unknown" of "base_sway" "base", scaled by shift_um turn_arcsec,
    |self| [("shift", "um", matrix::norm(self.shift_um)), ("turn", "arcsec", matrix::norm(self.turn_arcsec)), ("period", "s", self.period_s)]
}

impl Act for BaseSway {
    fn act(&self, state: &State, motion: &mut Motion) {
        let share = (std::f64::consts::TAU * state.row.time_s / self.period_s
            + self.phase_deg.to_radians())
        .sin();
        let by = step(self.shift_um, self.turn_arcsec, share);
        motion.base = matrix::times(&by, &motion.base);
    }
}
