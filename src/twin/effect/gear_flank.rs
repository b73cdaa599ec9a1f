//! Two flanks of a wheel's teeth, ground in two settings: each has its own run-out, and the joint runs on the one that drives it.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `amplitude sin(order q + phase)` on the flank that drives upwards, minus as much on the other; nothing before the first move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearFlank {
    /// From 1.
    pub joint: usize,
    /// Periods per turn of the joint.
    pub order: f64,
    /// Half the difference of the two flanks, arcsec.
    pub amplitude_arcsec: f64,
    /// Phase at zero, deg.
    #[serde(default)]
    pub phase_deg: f64,
}

impl Act for GearFlank {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        let run_out = self.amplitude_arcsec * (self.order * state.row.command[joint] + self.phase_deg.to_radians()).sin();
        motion.joint[joint] += ARCSEC * run_out * state.row.direction[joint];
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.amplitude_arcsec *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}", self.joint), format!("joint {}", self.joint));
        let (sine, cosine) = self.phase_deg.to_radians().sin_cos();
        let number = |name: &str, value: f64| {
            true_value("gear_flank", &tag, place.clone(), &format!("{name}{}", self.order), "arcsec", value)
        };
        vec![number("sin", self.amplitude_arcsec * cosine), number("cos", self.amplitude_arcsec * sine)]
    }
}
