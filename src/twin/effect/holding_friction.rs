//! Friction that keeps part of the last move's torque in the motor, so that the current at rest is not the load alone.

use super::{Act, Motion, State, TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Coulomb friction on the motor's side; it changes what the controller logs, not where the arm stands.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HoldingFriction {
    /// From 1.
    pub joint: usize,
    /// Torque at the joint in the direction of the last move, Nm.
    pub torque_nm: f64,
}

impl Act for HoldingFriction {
    fn act(&self, state: &State, motion: &mut Motion) {
        motion.motor_torque[self.joint - 1] += self.torque_nm * state.row.direction[self.joint - 1];
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.torque_nm *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let tag = format!("j{}", self.joint);
        vec![true_value("holding_friction", &tag, format!("joint {}", self.joint), "torque", "Nm", self.torque_nm)]
    }
}
