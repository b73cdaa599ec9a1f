//! A payload that is heavier than declared, or whose centre lies elsewhere.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::arm::Arm;
use crate::matrix::{self, Vector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// True payload against the declared one; it shows through springs and in the currents.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PayloadError {
    /// True mass per declared mass, less 1.
    #[serde(default)]
    pub mass_share: f64,
    /// Displacement of its centre at the zero pose along the base axes, mm.
    #[serde(default)]
    pub centre_mm: Vector,
}

impl Act for PayloadError {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn shape(&self, arm: &mut Arm) {
        arm.payload_share *= 1.0 + self.mass_share;
        arm.payload_centre = matrix::add(arm.payload_centre, matrix::scale(self.centre_mm, 1e-3));
    }
    fn scale(&mut self, by: f64) {
        self.mass_share *= by;
        self.centre_mm = matrix::scale(self.centre_mm, by);
    }
    fn truth(&self) -> Vec<TrueValue> {
        let value = |number: &str, unit, value| true_value("payload_error", "tool", "tool".into(), number, unit, value);
        vec![value("mass", "1", self.mass_share), value("centre", "mm", matrix::norm(self.centre_mm))]
    }
}
