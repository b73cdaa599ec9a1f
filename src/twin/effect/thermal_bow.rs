//! A bent link that grows: how much of the growth reaches the next body depends on how the next joint stands.

use super::{Act, Motion, State, effect};
use crate::matrix;

effect! {
    /// Growth of the link along its span by expansion times temperature rise times `cos(q)^power` of the next joint.
    pub struct ThermalBow {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// um per m and K.
        pub um_per_m_k: f64,
        /// Temperature at which the link has its length, C.
        pub reference_c: f64,
        /// Power of the cosine of the next joint.
        pub power: i32,
    }
    "unknown" at link ".bow", scaled by um_per_m_k, |self| [("expansion", "um/m/K", self.um_per_m_k)]
}

impl Act for ThermalBow {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let next = state.row.command.get(self.link).copied().unwrap_or(0.0);
        let strain = 1e-6
            * self.um_per_m_k
            * (state.row.temperature_c - self.reference_c)
            * next.cos().powi(self.power);
        let growth = matrix::shift(matrix::scale(state.arm.links[index].span, strain));
        motion.link_end[index] = matrix::times(&growth, &motion.link_end[index]);
    }
}
