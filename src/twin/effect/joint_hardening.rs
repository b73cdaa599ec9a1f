//! A gear that is softer under little torque than under much: teeth and rollers that first have to come into full contact.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The form of the wind-up beside the linear one, of amplitude 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// `tanh(torque / scale)`: lost motion and soft first contact that is used up at a few `scale`.
    Tanh,
    /// `-(torque / scale)^3`: the spring stiffens with torque; at `scale` it holds back the whole amplitude.
    Cubic,
    /// `torque / scale` held between -1 and 1: two slopes, soft up to `scale`.
    TwoSlope,
    /// `-load abs(load)` with `load = torque / scale`: stiffens, less abruptly than the cube.
    Square,
}

effect! {
    /// Wind-up beside the linear one.
    pub struct JointHardening {
        /// From 1.
        pub joint: usize,
        /// Over the torque.
        pub curve: Curve,
        /// arcsec.
        pub amplitude_arcsec: f64,
        /// The torque that sets the scale of the curve, Nm.
        pub scale_nm: f64,
    }
    "joint_hardening" at joint, scaled by amplitude_arcsec,
    |self| [("amplitude", "arcsec", self.amplitude_arcsec), ("scale", "Nm", self.scale_nm)]
}

impl Act for JointHardening {
    fn act(&self, state: &State, motion: &mut Motion) {
        let load = state.torque[self.joint - 1] / self.scale_nm;
        let shape = match self.curve {
            Curve::Tanh => load.tanh(),
            Curve::Cubic => -load.powi(3),
            Curve::TwoSlope => load.clamp(-1.0, 1.0),
            Curve::Square => -load * load.abs(),
        };
        motion.joint[self.joint - 1] += self.amplitude_arcsec * ARCSEC * shape;
    }
}
