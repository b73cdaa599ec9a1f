//! A warm link is longer: every span of it grows by expansion times temperature rise.

use super::{Act, Motion, State, effect};
use crate::matrix;

effect! {
    /// Growth of the link between joint N and joint N+1.
    pub struct ThermalGrowth {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// Expansion, um per m and K; steel and cast iron have 11 to 12.
        pub um_per_m_k: f64,
        /// Temperature at which the link has its length, C.
        pub reference_c: f64,
    }
    "thermal_growth" at link, scaled by um_per_m_k, |self| [("expansion", "um/m/K", self.um_per_m_k)]
}

impl Act for ThermalGrowth {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let strain = 1e-6 * self.um_per_m_k * (state.row.temperature_c - self.reference_c);
        let growth = matrix::shift(matrix::scale(state.arm.links[index].span, strain));
        motion.link_end[index] = matrix::times(&growth, &motion.link_end[index]);
    }
}
