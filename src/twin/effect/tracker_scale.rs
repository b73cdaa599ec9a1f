//! The tracker's metre is wrong, by its air's temperature or pressure: all lengths scale, and the robot's with them.

use super::{Act, Motion, State, effect};

effect! {
    /// Every measured coordinate is too large by this.
    pub struct TrackerScale {
        /// um per m.
        pub um_per_m: f64,
    }
    "tracker_scale" of "tracker" "tracker", scaled by um_per_m, |self| [("scale", "um/m", self.um_per_m)]
}

impl Act for TrackerScale {
    fn act(&self, _state: &State, motion: &mut Motion) {
        for row in motion.tracker.iter_mut().take(3) {
            row.iter_mut()
                .for_each(|number| *number *= 1.0 + 1e-6 * self.um_per_m);
        }
    }
}
