//! A joint's zero steps at some time: a collision, a slipped belt, a new mastering.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// A step of a joint from a moment on.
    pub struct ZeroShift {
        /// From 1.
        pub joint: usize,
        /// arcsec.
        pub step_arcsec: f64,
        /// The moment since the start of the recording, s.
        pub at_s: f64,
    }
    "zero_shift" at joint, scaled by step_arcsec, |self| [("step", "arcsec", self.step_arcsec), ("at", "s", self.at_s)]
}

impl Act for ZeroShift {
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            motion.joint[self.joint - 1] += self.step_arcsec * ARCSEC;
        }
    }
}
