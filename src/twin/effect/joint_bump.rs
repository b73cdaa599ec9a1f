//! A joint that is wrong near one angle only, as by a damaged tooth: an effect that no list expects.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `amplitude exp(-((q - centre) / width)^2)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointBump {
    /// From 1.
    pub joint: usize,
    /// arcsec.
    pub amplitude_arcsec: f64,
    /// Its middle, deg.
    pub centre_deg: f64,
    /// Its width, deg.
    pub width_deg: f64,
}

impl Act for JointBump {
    fn act(&self, state: &State, motion: &mut Motion) {
        let away = (state.row.command[self.joint - 1].to_degrees() - self.centre_deg) / self.width_deg;
        motion.joint[self.joint - 1] += self.amplitude_arcsec * ARCSEC * (-away * away).exp();
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.amplitude_arcsec *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let place = format!("joint {}", self.joint);
        let value = |number: &str, unit, value| {
            true_value("unknown", &format!("j{}.bump", self.joint), place.clone(), number, unit, value)
        };
        vec![
            value("amplitude", "arcsec", self.amplitude_arcsec),
            value("centre", "deg", self.centre_deg),
            value("width", "deg", self.width_deg),
        ]
    }
}
