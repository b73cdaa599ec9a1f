//! Somebody knocks against the tracker's stand: to the data the robot's base steps the other way.

use super::{Act, Motion, State, effect};
use crate::matrix::{self, Vector};
use crate::motion::step;

effect! {
    /// A rigid step of what is measured from a moment on, of which a part may settle back.
    pub struct TrackerKnock {
        /// Displacement, tracker frame, um.
        #[serde(default)]
        pub shift_um: Vector,
        /// Rotation vector about the tracker's origin, arcsec.
        #[serde(default)]
        pub turn_arcsec: Vector,
        /// The moment since the start of the recording, s.
        pub at_s: f64,
        /// Share of the step that settles back.
        #[serde(default)]
        pub back_share: f64,
        /// Time constant of that, s.
        #[serde(default = "minute")]
        pub back_s: f64,
    }
    // Named by the stand's own numbers: those of the base have another frame.
    "base_shift" of "stand" "base", scaled by shift_um turn_arcsec,
    |self| [("shift", "um", matrix::norm(self.shift_um)), ("turn", "arcsec", matrix::norm(self.turn_arcsec)), ("at", "s", self.at_s)]
}

fn minute() -> f64 {
    60.0
}

impl Act for TrackerKnock {
    fn act(&self, state: &State, motion: &mut Motion) {
        let since = state.row.time_s - self.at_s;
        if since >= 0.0 {
            let share = 1.0 - self.back_share * (1.0 - (-since / self.back_s).exp());
            let by = step(self.shift_um, self.turn_arcsec, share);
            motion.tracker = matrix::times(&by, &motion.tracker);
        }
    }
}
