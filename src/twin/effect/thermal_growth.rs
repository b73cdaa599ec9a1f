//! A warm link is longer: every span of it grows by expansion times temperature rise.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Growth of the link between joint N and joint N+1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThermalGrowth {
    /// From 1: the body moved by joint N.
    pub link: usize,
    /// Expansion, um per m and K; steel and cast iron have 11 to 12.
    pub um_per_m_k: f64,
    /// Temperature at which the link has its length, C.
    pub reference_c: f64,
}

impl Act for ThermalGrowth {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let strain = 1e-6 * self.um_per_m_k * (state.row.temperature_c - self.reference_c);
        let growth = matrix::shift(matrix::scale(state.arm.links[index].span, strain));
        motion.link_end[index] = matrix::times(&growth, &motion.link_end[index]);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.link)
    }
    fn scale(&mut self, by: f64) {
        self.um_per_m_k *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let tag = format!("l{}", self.link);
        vec![true_value("thermal_growth", &tag, format!("link {}", self.link), "expansion", "um/m/K", self.um_per_m_k)]
    }
}
