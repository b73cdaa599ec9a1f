//! A gear that gives more when it is approached from one side than from the other: its wind-up depends on the direction.

use super::{Act, Motion, State, TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Wind-up `direction torque` times half the difference of the two compliances.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointHysteresis {
    /// From 1.
    pub joint: usize,
    /// Compliance after an upward move less that after a downward one, rad/Nm.
    pub rad_per_nm: f64,
}

impl Act for JointHysteresis {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        motion.joint[joint] += 0.5 * self.rad_per_nm * state.torque[joint] * state.row.direction[joint];
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.rad_per_nm *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let tag = format!("j{}", self.joint);
        vec![true_value("backlash", &tag, format!("joint {}", self.joint), "compliance", "rad/Nm", self.rad_per_nm)]
    }
}
