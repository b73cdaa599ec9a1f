//! A joint that is wrong near one angle only, as by a damaged tooth: an effect that no list expects.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// `amplitude exp(-((q - centre) / width)^2)`.
    pub struct JointBump {
        /// From 1.
        pub joint: usize,
        /// arcsec.
        pub amplitude_arcsec: f64,
        /// Its middle, deg.
        pub centre_deg: f64,
        /// Its width, deg.
        pub width_deg: f64,
    }
    "unknown" at joint ".bump", scaled by amplitude_arcsec,
    |self| [("amplitude", "arcsec", self.amplitude_arcsec), ("centre", "deg", self.centre_deg), ("width", "deg", self.width_deg)]
}

impl Act for JointBump {
    fn act(&self, state: &State, motion: &mut Motion) {
        let away =
            (state.row.command[self.joint - 1].to_degrees() - self.centre_deg) / self.width_deg;
        motion.joint[self.joint - 1] += self.amplitude_arcsec * ARCSEC * (-away * away).exp();
    }
}
