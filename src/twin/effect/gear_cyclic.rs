//! Run-out of gears and encoders: joint errors that repeat with every turn of the joint or of the motor.
//!
//! A mesh is also softer with fewer teeth in contact, so that the wind-up itself repeats: that part grows with the torque.

use super::{Act, Motion, State, effect, sine_and_cosine};
use crate::truth::ARCSEC;

effect! {
    /// `(amplitude + arcsec_per_nm torque) sin(order q + phase)`.
    pub struct GearCyclic {
        /// From 1.
        pub joint: usize,
        /// Periods per turn of the joint.
        pub order: f64,
        /// arcsec.
        #[serde(default)]
        pub amplitude_arcsec: f64,
        /// Growth of the amplitude with the load, arcsec per Nm.
        #[serde(default)]
        pub arcsec_per_nm: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "gear_cyclic" at joint, scaled by amplitude_arcsec arcsec_per_nm, |self| {
        let growth = (format!("growth{}", self.order), "arcsec/Nm", self.arcsec_per_nm);
        let waves = sine_and_cosine(self.order, "arcsec", self.amplitude_arcsec, self.phase_deg);
        waves.into_iter().chain((self.arcsec_per_nm != 0.0).then_some(growth))
    }
}

effect! {
    /// `amplitude sin(order N q + phase)` with the reduction ratio N.
    pub struct GearMotorCyclic {
        /// From 1.
        pub joint: usize,
        /// Periods per turn of the motor.
        pub order: f64,
        /// arcsec at the joint.
        pub amplitude_arcsec: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "gear_motor_cyclic" at joint, scaled by amplitude_arcsec,
    |self| sine_and_cosine(self.order, "arcsec", self.amplitude_arcsec, self.phase_deg)
}

fn ripple(amplitude_arcsec: f64, order: f64, angle: f64, phase_deg: f64) -> f64 {
    amplitude_arcsec * ARCSEC * (order * angle + phase_deg.to_radians()).sin()
}

impl Act for GearCyclic {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = state.row.command[self.joint - 1];
        let amplitude = self.amplitude_arcsec + self.arcsec_per_nm * state.torque[self.joint - 1];
        motion.joint[self.joint - 1] += ripple(amplitude, self.order, angle, self.phase_deg);
    }
}

impl Act for GearMotorCyclic {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = state.row.command[self.joint - 1] * state.arm.links[self.joint - 1].gear;
        motion.joint[self.joint - 1] +=
            ripple(self.amplitude_arcsec, self.order, angle, self.phase_deg);
    }
}
