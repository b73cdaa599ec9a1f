//! The base steps on its foundation at some time: a collision, a loosened anchor.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix::{self, Vector};
use crate::motion::step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rigid step of the base from a moment on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
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

impl Act for BaseShift {
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            let by = step(self.shift_um, self.turn_arcsec, 1.0);
            motion.base = matrix::times(&by, &motion.base);
        }
    }
    fn scale(&mut self, by: f64) {
        self.shift_um = matrix::scale(self.shift_um, by);
        self.turn_arcsec = matrix::scale(self.turn_arcsec, by);
    }
    fn truth(&self) -> Vec<TrueValue> {
        let axes = ["x", "y", "z"].into_iter().enumerate();
        axes.flat_map(|(index, axis)| {
            let value = |number: String, unit, value| true_value("base_shift", "base", "base".into(), &number, unit, value);
            [
                value(format!("shift_{axis}"), "um", self.shift_um[index]),
                value(format!("turn_{axis}"), "arcsec", self.turn_arcsec[index]),
            ]
        })
        .chain([true_value("base_shift", "base", "base".into(), "at", "s", self.at_s)])
        .collect()
    }
}
