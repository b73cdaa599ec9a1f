//! A joint whose error sets in at some angle, as where a dress pack or a stop begins to press: an effect that no list expects.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Nothing below the angle, in proportion to what is beyond above it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointHinge {
    /// From 1.
    pub joint: usize,
    /// Where it begins, deg.
    pub from_deg: f64,
    /// arcsec per rad beyond.
    pub arcsec_per_rad: f64,
}

impl Act for JointHinge {
    fn act(&self, state: &State, motion: &mut Motion) {
        let beyond = (state.row.command[self.joint - 1] - self.from_deg.to_radians()).max(0.0);
        motion.joint[self.joint - 1] += self.arcsec_per_rad * ARCSEC * beyond;
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.arcsec_per_rad *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}.hinge", self.joint), format!("joint {}", self.joint));
        vec![
            true_value("unknown", &tag, place.clone(), "slope", "arcsec/rad", self.arcsec_per_rad),
            true_value("unknown", &tag, place, "from", "deg", self.from_deg),
        ]
    }
}
