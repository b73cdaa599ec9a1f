//! A link that warms up at its own pace: behind the sensor, or with no sensor at all.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Growth by `1 - exp(-t / warm_up)` of a final strain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalWarmUp {
    /// From 1: the body moved by joint N.
    pub link: usize,
    /// Final growth, um per m.
    pub um_per_m: f64,
    /// Time constant, h.
    pub warm_up_h: f64,
}

impl Act for ThermalWarmUp {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let strain = 1e-6 * self.um_per_m * (1.0 - (-state.row.time_s / (3600.0 * self.warm_up_h)).exp());
        let growth = matrix::shift(matrix::scale(state.arm.links[index].span, strain));
        motion.link_end[index] = matrix::times(&growth, &motion.link_end[index]);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.link)
    }
    fn scale(&mut self, by: f64) {
        self.um_per_m *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("l{}", self.link), format!("link {}", self.link));
        vec![
            true_value("thermal_growth", &tag, place.clone(), "final", "um/m", self.um_per_m),
            true_value("thermal_growth", &tag, place, "warm_up", "h", self.warm_up_h),
        ]
    }
}
