//! A link that warms up at its own pace: behind the sensor, or with no sensor at all.

use super::{Act, Motion, State, effect};
use crate::matrix;

effect! {
    /// Growth by `1 - exp(-t / warm_up)` of a final strain.
    pub struct ThermalWarmUp {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// Final growth, um per m.
        pub um_per_m: f64,
        /// Time constant, h.
        pub warm_up_h: f64,
    }
    "thermal_growth" at link, scaled by um_per_m, |self| [("final", "um/m", self.um_per_m), ("warm_up", "h", self.warm_up_h)]
}

impl Act for ThermalWarmUp {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let strain =
            1e-6 * self.um_per_m * (1.0 - (-state.row.time_s / (3600.0 * self.warm_up_h)).exp());
        let growth = matrix::shift(matrix::scale(state.arm.links[index].span, strain));
        motion.link_end[index] = matrix::times(&growth, &motion.link_end[index]);
    }
}
