//! The reflector or the tool steps in its mounting at some time.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix::{self, Vector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A step of the measured point from a moment on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ToolShift {
    /// Displacement at the zero pose along the base axes, um.
    pub shift_um: Vector,
    /// The moment since the start of the recording, s.
    pub at_s: f64,
}

impl Act for ToolShift {
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            motion.tool = matrix::add(motion.tool, matrix::scale(self.shift_um, 1e-6));
        }
    }
    fn scale(&mut self, by: f64) {
        self.shift_um = matrix::scale(self.shift_um, by);
    }
    fn truth(&self) -> Vec<TrueValue> {
        let value = |number: &str, unit, value| true_value("tool_shift", "tool", "tool".into(), number, unit, value);
        let shift = ["shift_x", "shift_y", "shift_z"].into_iter().zip(self.shift_um);
        shift.map(|(number, shift)| value(number, "um", shift)).chain([value("at", "s", self.at_s)]).collect()
    }
}
