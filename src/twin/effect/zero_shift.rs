//! A joint's zero steps at some time: a collision, a slipped belt, a new mastering.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A step of a joint from a moment on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZeroShift {
    /// From 1.
    pub joint: usize,
    /// arcsec.
    pub step_arcsec: f64,
    /// The moment since the start of the recording, s.
    pub at_s: f64,
}

impl Act for ZeroShift {
    fn act(&self, state: &State, motion: &mut Motion) {
        if state.row.time_s >= self.at_s {
            motion.joint[self.joint - 1] += self.step_arcsec * ARCSEC;
        }
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.step_arcsec *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}", self.joint), format!("joint {}", self.joint));
        vec![
            true_value("zero_shift", &tag, place.clone(), "step", "arcsec", self.step_arcsec),
            true_value("zero_shift", &tag, place, "at", "s", self.at_s),
        ]
    }
}
