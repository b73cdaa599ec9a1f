//! The base swings slowly, as a floor does with a neighbour's machine or the sun: an effect that no list expects.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix::{self, Vector};
use crate::motion::step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sine of time in one direction of motion of the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
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

impl Act for BaseSway {
    fn act(&self, state: &State, motion: &mut Motion) {
        let share = (std::f64::consts::TAU * state.row.time_s / self.period_s + self.phase_deg.to_radians()).sin();
        let by = step(self.shift_um, self.turn_arcsec, share);
        motion.base = matrix::times(&by, &motion.base);
    }
    fn scale(&mut self, by: f64) {
        self.shift_um = matrix::scale(self.shift_um, by);
        self.turn_arcsec = matrix::scale(self.turn_arcsec, by);
    }
    fn truth(&self) -> Vec<TrueValue> {
        let value = |number: &str, unit, value| true_value("unknown", "base_sway", "base".into(), number, unit, value);
        vec![
            value("shift", "um", matrix::norm(self.shift_um)),
            value("turn", "arcsec", matrix::norm(self.turn_arcsec)),
            value("period", "s", self.period_s),
        ]
    }
}
