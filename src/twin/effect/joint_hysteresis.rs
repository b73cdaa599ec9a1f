//! A gear that gives more when it is approached from one side than from the other: its wind-up depends on the direction.

use super::{Act, Motion, State, effect};

effect! {
    /// Wind-up `direction torque` times half the difference of the two compliances.
    pub struct JointHysteresis {
        /// From 1.
        pub joint: usize,
        /// Compliance after an upward move less that after a downward one, rad/Nm.
        pub rad_per_nm: f64,
    }
    "backlash" at joint, scaled by rad_per_nm, |self| [("compliance", "rad/Nm", self.rad_per_nm)]
}

impl Act for JointHysteresis {
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        motion.joint[joint] +=
            0.5 * self.rad_per_nm * state.torque[joint] * state.row.direction[joint];
    }
}
