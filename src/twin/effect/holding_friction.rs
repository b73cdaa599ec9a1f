//! Friction that keeps part of the last move's torque in the motor, so that the current at rest is not the load alone.

use super::{Act, Motion, State, effect};

effect! {
    /// Coulomb friction on the motor's side; it changes what the controller logs, not where the arm stands.
    pub struct HoldingFriction {
        /// From 1.
        pub joint: usize,
        /// Torque at the joint in the direction of the last move, Nm.
        pub torque_nm: f64,
    }
    "holding_friction" at joint, scaled by torque_nm, |self| [("torque", "Nm", self.torque_nm)]
}

impl Act for HoldingFriction {
    fn act(&self, state: &State, motion: &mut Motion) {
        motion.motor_torque[self.joint - 1] += self.torque_nm * state.row.direction[self.joint - 1];
    }
}
