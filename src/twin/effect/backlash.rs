//! Lost motion: the joint stops short on the side from which it comes, unless the load holds the teeth together.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::twin::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Half a gap either way: by the direction of approach where the load is light, by the load where it is not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Backlash {
    /// From 1.
    pub joint: usize,
    /// The whole gap, arcsec.
    pub gap_arcsec: f64,
    /// The torque that pushes the teeth to one side whatever the direction, Nm; 0: direction alone decides.
    #[serde(default)]
    pub closing_nm: f64,
}

impl Act for Backlash {
    fn act(&self, state: &State, motion: &mut Motion) {
        let torque = state.torque[self.joint - 1];
        let side = if self.closing_nm > 0.0 && torque.abs() > self.closing_nm {
            torque.signum()
        } else {
            // The link trails the motor by half the gap.
            -state.row.direction[self.joint - 1]
        };
        motion.joint[self.joint - 1] += 0.5 * self.gap_arcsec * ARCSEC * side;
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}", self.joint), format!("joint {}", self.joint));
        vec![
            true_value("backlash", &tag, place.clone(), "gap", "arcsec", self.gap_arcsec),
            true_value("backlash", &tag, place, "closing", "Nm", self.closing_nm),
        ]
    }
}
