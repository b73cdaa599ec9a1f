//! A gear whose run-out grows with what it carries: a soft mesh, teeth that share the load unevenly.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `arcsec_per_nm load sin(order q + phase)`; the load saturates as `full tanh(torque / full)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GearLoad {
    /// From 1.
    pub joint: usize,
    /// Periods per turn of the joint.
    pub order: f64,
    /// Amplitude for each Nm of load.
    pub arcsec_per_nm: f64,
    /// Phase at zero, deg.
    #[serde(default)]
    pub phase_deg: f64,
    /// Torque at which the mesh is fully in contact, Nm; 0: it never is.
    #[serde(default)]
    pub full_nm: f64,
}

impl Act for GearLoad {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        let torque = state.torque[joint];
        let load = if self.full_nm > 0.0 { self.full_nm * (torque / self.full_nm).tanh() } else { torque };
        let wave = (self.order * state.row.command[joint] + self.phase_deg.to_radians()).sin();
        motion.joint[joint] += ARCSEC * self.arcsec_per_nm * load * wave;
    }
    fn seat(&self) -> Option<usize> {
        Some(self.joint)
    }
    fn scale(&mut self, by: f64) {
        self.arcsec_per_nm *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let (tag, place) = (format!("j{}", self.joint), format!("joint {}", self.joint));
        let (sine, cosine) = self.phase_deg.to_radians().sin_cos();
        let number = |name: &str, value: f64| {
            true_value("gear_load", &tag, place.clone(), &format!("{name}{}", self.order), "arcsec/Nm", value)
        };
        vec![number("sin", self.arcsec_per_nm * cosine), number("cos", self.arcsec_per_nm * sine)]
    }
}
