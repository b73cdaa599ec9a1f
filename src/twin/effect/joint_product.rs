//! A joint whose error is a product of two other angles: an effect that no list expects.

use super::{Act, Motion, State, effect};
use crate::truth::ARCSEC;

effect! {
    /// `slope q_first q_second`, angles in rad.
    pub struct JointProduct {
        /// From 1.
        pub joint: usize,
        /// The two joints that cause it, from 1.
        pub of: [usize; 2],
        /// arcsec per rad2.
        pub arcsec_per_rad2: f64,
    }
    "unknown" at joint ".product", scaled by arcsec_per_rad2, |self| [("slope", "arcsec/rad2", self.arcsec_per_rad2)]
}

impl Act for JointProduct {
    fn act(&self, state: &State, motion: &mut Motion) {
        let angle = |joint: usize| {
            state
                .row
                .command
                .get(joint.saturating_sub(1))
                .copied()
                .unwrap_or(0.0)
        };
        motion.joint[self.joint - 1] +=
            self.arcsec_per_rad2 * ARCSEC * angle(self.of[0]) * angle(self.of[1]);
    }
}
