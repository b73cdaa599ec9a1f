//! A hose package that pulls on a joint; how hard depends on that joint and on another one, along which it is led.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the pull depends on `u = q_joint + lead q_by + phase`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pull {
    /// `sin u`: a hose hung over both joints.
    Swing,
    /// `u^2 / 4`: a hose that is bent further the more both joints turn.
    Bend,
}

effect! {
    /// Torque of a hose, or the turn by it where the joint's spring is not stated.
    pub struct CableDrag {
        /// From 1.
        pub joint: usize,
        /// The other joint, from 1.
        pub by: usize,
        /// Share of the other joint in the bend of the hose.
        pub lead: f64,
        /// How it pulls.
        pub pull: Pull,
        /// Turn of the joint by the pull, arcsec.
        #[serde(default)]
        pub amplitude_arcsec: f64,
        /// Torque of the pull, Nm: the joint's spring and the motor feel it.
        #[serde(default)]
        pub torque_nm: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "cable_drag" at joint, scaled by amplitude_arcsec torque_nm,
    |self| [("amplitude", "arcsec", self.amplitude_arcsec), ("torque", "Nm", self.torque_nm)]
}

impl Act for CableDrag {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = &state.row.command;
        let other = angle.get(self.by.saturating_sub(1)).copied().unwrap_or(0.0);
        let u = angle[self.joint - 1] + self.lead * other + self.phase_deg.to_radians();
        let pull = match self.pull {
            Pull::Swing => u.sin(),
            Pull::Bend => 0.25 * u * u,
        };
        motion.joint[self.joint - 1] += self.amplitude_arcsec * ARCSEC * pull;
        motion.load[self.joint - 1] += self.torque_nm * pull;
    }
}
