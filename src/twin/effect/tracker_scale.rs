//! The tracker's metre is wrong, by its air's temperature or pressure: all lengths scale, and the robot's with them.

use super::{Act, Motion, State, TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Every measured coordinate is too large by this.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackerScale {
    /// um per m.
    pub um_per_m: f64,
}

impl Act for TrackerScale {
    fn act(&self, _state: &State, motion: &mut Motion) {
        for row in motion.tracker.iter_mut().take(3) {
            row.iter_mut().for_each(|number| *number *= 1.0 + 1e-6 * self.um_per_m);
        }
    }
    fn scale(&mut self, by: f64) {
        self.um_per_m *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        vec![true_value("tracker_scale", "tracker", "tracker".into(), "scale", "um/m", self.um_per_m)]
    }
}
