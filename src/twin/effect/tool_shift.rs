//! The reflector or the tool steps in its mounting at some time.

use super::{Act, Motion, State, effect};
use crate::matrix::{self, Vector};

effect! {
    /// A step of the measured point from a moment on.
    pub struct ToolShift {
        /// Displacement at the zero pose along the base axes, um.
        pub shift_um: Vector,
        /// The moment since the start of the recording, s.
        pub at_s: f64,
    }
    "tool_shift" of "tool" "tool", scaled by shift_um, |self| {
        let [x, y, z] = self.shift_um;
        [("shift_x", "um", x), ("shift_y", "um", y), ("shift_z", "um", z), ("at", "s", self.at_s)]
    }
}

impl Act for ToolShift {
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            motion.tool = matrix::add(motion.tool, matrix::scale(self.shift_um, 1e-6));
        }
    }
}
