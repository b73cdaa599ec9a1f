//! A gear winds up in proportion to the torque that gravity puts on its joint.

use super::{Act, Motion, State, effect};

effect! {
    /// A linear torsion spring between motor and link.
    pub struct JointCompliance {
        /// From 1.
        pub joint: usize,
        /// Wind-up per torque, rad/Nm.
        pub rad_per_nm: f64,
    }
    "joint_compliance" at joint, scaled by rad_per_nm, |self| [("", "rad/Nm", self.rad_per_nm)]
}

impl Act for JointCompliance {
    fn act(&self, state: &State, motion: &mut Motion) {
        motion.joint[self.joint - 1] += self.rad_per_nm * state.torque[self.joint - 1];
    }
}
