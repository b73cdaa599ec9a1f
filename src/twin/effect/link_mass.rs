//! A link that is heavier than its description says, or whose centre lies elsewhere.

use super::{Act, Motion, State, effect};
use crate::arm::Arm;
use crate::matrix::{self, Vector};

effect! {
    /// True mass and centre of a link against the described ones; they show through springs and in the currents.
    pub struct LinkMass {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// True mass per described mass, less 1.
        #[serde(default)]
        pub mass_share: f64,
        /// Displacement of its centre at the zero pose along the base axes, mm.
        #[serde(default)]
        pub centre_mm: Vector,
    }
    "link_mass" at link, scaled by mass_share centre_mm,
    |self| [("mass", "1", self.mass_share), ("centre", "mm", matrix::norm(self.centre_mm))]
}

impl Act for LinkMass {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn shape(&self, arm: &mut Arm) {
        if let Some(link) = arm.links.get_mut(self.link - 1) {
            link.mass *= 1.0 + self.mass_share;
            link.centre = matrix::add(link.centre, matrix::scale(self.centre_mm, 1e-3));
        }
    }
}
