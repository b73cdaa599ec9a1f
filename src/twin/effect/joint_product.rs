//! A joint whose error is a product of two other angles: an effect that no list expects.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `slope q_first q_second`, angles in rad.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointProduct {
    /// From 1.
    pub joint: usize,
    /// The two joints that cause it, from 1.
    pub of: [usize; 2],
    /// arcsec per rad2.
    pub arcsec_per_rad2: f64,
}

impl Act for JointProduct {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = |joint: usize| state.row.command.get(joint.saturating_sub(1)).copied().unwrap_or(0.0);
        motion.joint[self.joint - 1] += self.arcsec_per_rad2 * ARCSEC * angle(self.of[0]) * angle(self.of[1]);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.arcsec_per_rad2 *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}.product", self.joint), format!("joint {}", self.joint));
        vec![true_value("unknown", &tag, place, "slope", "arcsec/rad2", self.arcsec_per_rad2)]
    }
}
