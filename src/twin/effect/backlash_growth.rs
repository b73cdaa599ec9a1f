//! A gap that wears or loosens while the arm works: lost motion that grows with time.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// Half the gap against the last motion; `start` of it is there at first, the rest grows.
    pub struct BacklashGrowth {
        /// From 1.
        pub joint: usize,
        /// The whole gap when it has grown, arcsec.
        pub gap_arcsec: f64,
        /// Share of it at time 0.
        #[serde(default)]
        pub start: f64,
        /// Time in which it grows, s: straight, and on beyond.
        pub time_s: f64,
        /// It grows as `1 - exp(-t / time)` instead.
        #[serde(default)]
        pub settling: bool,
    }
    "backlash" at joint, scaled by gap_arcsec, |self| [("grown", "arcsec", self.gap_arcsec), ("time", "s", self.time_s)]
}

impl Act for BacklashGrowth {
    fn act(&self, state: &State, motion: &mut Motion) {
        let u = state.row.time_s / self.time_s;
        let grown = if self.settling { 1.0 - (-u).exp() } else { u };
        let gap = self.gap_arcsec * (self.start + (1.0 - self.start) * grown);
        motion.joint[self.joint - 1] -= 0.5 * ARCSEC * gap * state.row.direction[self.joint - 1];
    }
}
