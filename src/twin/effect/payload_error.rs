//! A payload that is heavier than declared, or whose centre lies elsewhere.

use super::{Act, Motion, State, effect};
use crate::arm::Arm;
use crate::matrix::{self, Vector};

effect! {
    /// True payload against the declared one; it shows through springs and in the currents.
    pub struct PayloadError {
        /// True mass per declared mass, less 1.
        #[serde(default)]
        pub mass_share: f64,
        /// Displacement of its centre at the zero pose along the base axes, mm.
        #[serde(default)]
        pub centre_mm: Vector,
    }
    "payload_error" of "tool" "tool", scaled by mass_share centre_mm,
    |self| [("mass", "1", self.mass_share), ("centre", "mm", matrix::norm(self.centre_mm))]
}

impl Act for PayloadError {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn shape(&self, arm: &mut Arm) {
        arm.payload_share *= 1.0 + self.mass_share;
        arm.payload_centre = matrix::add(arm.payload_centre, matrix::scale(self.centre_mm, 1e-3));
    }
}
