//! A gear winds up in proportion to the torque that gravity puts on its joint.

use super::{Act, Motion, State, TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A linear torsion spring between motor and link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointCompliance {
    /// From 1.
    pub joint: usize,
    /// Wind-up per torque, rad/Nm.
    pub rad_per_nm: f64,
}

impl Act for JointCompliance {
    fn act(&self, state: &State, motion: &mut Motion) {
        motion.joint[self.joint - 1] += self.rad_per_nm * state.torque[self.joint - 1];
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.rad_per_nm *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let tag = format!("j{}", self.joint);
        vec![true_value("joint_compliance", &tag, format!("joint {}", self.joint), "", "rad/Nm", self.rad_per_nm)]
    }
}
