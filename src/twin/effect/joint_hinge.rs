//! A joint whose error sets in at some angle, as where a dress pack or a stop begins to press: an effect that no list expects.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// Nothing below the angle, in proportion to what is beyond above it.
    pub struct JointHinge {
        /// From 1.
        pub joint: usize,
        /// Where it begins, deg.
        pub from_deg: f64,
        /// arcsec per rad beyond.
        pub arcsec_per_rad: f64,
    }
    "unknown" at joint ".hinge", scaled by arcsec_per_rad,
    |self| [("slope", "arcsec/rad", self.arcsec_per_rad), ("from", "deg", self.from_deg)]
}

impl Act for JointHinge {
    fn act(&self, state: &State, motion: &mut Motion) {
        let beyond = (state.row.command[self.joint - 1] - self.from_deg.to_radians()).max(0.0);
        motion.joint[self.joint - 1] += self.arcsec_per_rad * ARCSEC * beyond;
    }
}
