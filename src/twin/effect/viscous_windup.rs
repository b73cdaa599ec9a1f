//! Friction of grease and seals that grows with speed winds a gear up: the joint's output trails behind its motor.

use super::{Act, Motion, State, effect};

effect! {
    /// The output of a joint trails behind its motor while it turns.
    pub struct ViscousWindup {
        /// From 1.
        pub joint: usize,
        /// Arcsec for each deg/s (um for each mm/s of a prismatic joint), at 20 deg/s.
        pub arcsec_per_deg_s: f64,
        /// Friction grows with this power of the speed: 1 for oil, less for grease.
        #[serde(default = "one")]
        pub exponent: f64,
    }
    "viscous_windup" at joint, scaled by arcsec_per_deg_s, |self| [("trail", "rad/(rad/s)", self.trail())]
}

fn one() -> f64 {
    1.0
}

/// rad/s: the speed at which every exponent gives the same.
const KNOWN_AT: f64 = 20.0 * std::f64::consts::PI / 180.0;

impl ViscousWindup {
    /// s.
    fn trail(&self) -> f64 {
        self.arcsec_per_deg_s / 3600.0
    }
}

impl Act for ViscousWindup {
    fn act(&self, state: &State, motion: &mut Motion) {
        let speed = state
            .row
            .velocity
            .get(self.joint - 1)
            .copied()
            .unwrap_or(0.0);
        let friction = KNOWN_AT * (speed.abs() / KNOWN_AT).powf(self.exponent) * speed.signum();
        if speed != 0.0 {
            motion.joint[self.joint - 1] -= self.trail() * friction;
        }
    }
    fn moves_only(&self) -> bool {
        true
    }
}
