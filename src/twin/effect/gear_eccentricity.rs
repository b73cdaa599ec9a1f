//! A wheel or code disc set off its centre by much: the error repeats with every turn but is no pure sine.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `amplitude sin u / (1 + skew cos u)` with `u = order q + phase`: higher harmonics fall by about half the skew each.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearEccentricity {
    /// From 1.
    pub joint: usize,
    /// Periods per turn of the joint.
    pub order: f64,
    /// arcsec.
    pub amplitude_arcsec: f64,
    /// Below 1.
    pub skew: f64,
    /// Phase at zero, deg.
    #[serde(default)]
    pub phase_deg: f64,
}

impl Act for GearEccentricity {
    fn act(&self, state: &State, motion: &mut Motion) {
        let (sine, cosine) = (self.order * state.row.command[self.joint - 1] + self.phase_deg.to_radians()).sin_cos();
        motion.joint[self.joint - 1] += self.amplitude_arcsec * ARCSEC * sine / (1.0 + self.skew * cosine);
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.amplitude_arcsec *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}", self.joint), format!("joint {}", self.joint));
        vec![true_value("gear_cyclic", &tag, place, "eccentricity", "arcsec", self.amplitude_arcsec)]
    }
}
