//! Two flanks of a wheel's teeth, ground in two settings: each has its own run-out, and the joint runs on the one that drives it.

use super::{Act, Motion, State, effect, sine_and_cosine};
use crate::truth::ARCSEC;

effect! {
    /// `amplitude sin(order q + phase)` on the flank that drives upwards, minus as much on the other; nothing before the first move.
    pub struct GearFlank {
        /// From 1.
        pub joint: usize,
        /// Periods per turn of the joint.
        pub order: f64,
        /// Half the difference of the two flanks, arcsec.
        pub amplitude_arcsec: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "gear_flank" at joint, scaled by amplitude_arcsec,
    |self| sine_and_cosine(self.order, "arcsec", self.amplitude_arcsec, self.phase_deg)
}

impl Act for GearFlank {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        let run_out = self.amplitude_arcsec
            * (self.order * state.row.command[joint] + self.phase_deg.to_radians()).sin();
        motion.joint[joint] += ARCSEC * run_out * state.row.direction[joint];
    }
}
