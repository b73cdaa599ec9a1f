//! Lost motion: the joint stops short on the side from which it comes, unless the load holds the teeth together.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// Half a gap either way: by the direction of approach where the load is light, by the load where it is not. Teeth and bearings
    /// under load also give back less than they took: the loop opens with the torque.
    pub struct Backlash {
        /// From 1.
        pub joint: usize,
        /// The whole gap, arcsec.
        pub gap_arcsec: f64,
        /// Growth of the gap with the torque, arcsec per Nm: the hysteresis of the loaded gear.
        #[serde(default)]
        pub arcsec_per_nm: f64,
        /// The torque that pushes the teeth to one side whatever the direction, Nm; 0: direction alone decides.
        #[serde(default)]
        pub closing_nm: f64,
        /// Over about this torque the load carries the joint from one side of the gap to the other, Nm; 0: at once, as `closing_nm` says.
        #[serde(default)]
        pub soft_nm: f64,
    }
    "backlash" at joint, scaled by gap_arcsec arcsec_per_nm, |self| [
        ("gap", "arcsec", self.gap_arcsec),
        ("growth", "arcsec/Nm", self.arcsec_per_nm),
        ("closing", "Nm", self.closing_nm),
        ("soft", "Nm", self.soft_nm),
    ]
}

impl Act for Backlash {
    fn act(&self, state: &State, motion: &mut Motion) {
        let torque = state.torque[self.joint - 1];
        let side = if self.soft_nm > 0.0 {
            (torque / self.soft_nm).tanh()
        } else if self.closing_nm > 0.0 && torque.abs() > self.closing_nm {
            torque.signum()
        } else {
            // The link trails the motor by half the gap.
            -state.row.direction[self.joint - 1]
        };
        // Hysteresis follows the direction even where the load has closed the gap.
        let loop_arcsec = self.arcsec_per_nm * torque.abs() * -state.row.direction[self.joint - 1];
        motion.joint[self.joint - 1] += 0.5 * ARCSEC * (self.gap_arcsec * side + loop_arcsec);
    }
}
