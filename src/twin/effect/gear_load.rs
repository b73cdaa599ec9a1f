//! A gear whose run-out grows with what it carries: a soft mesh, teeth that share the load unevenly.

use super::{Act, Motion, State, effect, sine_and_cosine};
use crate::truth::ARCSEC;

effect! {
    /// `arcsec_per_nm load sin(order q + phase)`; the load saturates as `full tanh(torque / full)`.
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
    "gear_load" at joint, scaled by arcsec_per_nm,
    |self| sine_and_cosine(self.order, "arcsec/Nm", self.arcsec_per_nm, self.phase_deg)
}

impl Act for GearLoad {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        let torque = state.torque[joint];
        let load = if self.full_nm > 0.0 {
            self.full_nm * (torque / self.full_nm).tanh()
        } else {
            torque
        };
        let wave = (self.order * state.row.command[joint] + self.phase_deg.to_radians()).sin();
        motion.joint[joint] += ARCSEC * self.arcsec_per_nm * load * wave;
    }
}
