//! A wheel or code disc set off its centre by much: the error repeats with every turn but is no pure sine.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// `amplitude sin u / (1 + skew cos u)` with `u = order q + phase`: higher harmonics fall by about half the skew each.
    pub struct GearEccentricity {
        /// From 1.
        pub joint: usize,
        /// Periods per turn of the joint.
        pub order: f64,
        /// arcsec.
        pub amplitude_arcsec: f64,
        /// Below 1.
        pub skew: f64,
        /// Phase at zero, deg.
        #[serde(default)]
        pub phase_deg: f64,
    }
    "gear_cyclic" at joint, scaled by amplitude_arcsec, |self| [("eccentricity", "arcsec", self.amplitude_arcsec)]
}

impl Act for GearEccentricity {
    fn act(&self, state: &State, motion: &mut Motion) {
        let (sine, cosine) = (self.order * state.row.command[self.joint - 1]
            + self.phase_deg.to_radians())
        .sin_cos();
        motion.joint[self.joint - 1] +=
            self.amplitude_arcsec * ARCSEC * sine / (1.0 + self.skew * cosine);
    }
}
