//! Metal that lags the thermometer: a thick casting is still cold where the sensor on its skin is warm.

use super::{Act, Motion, State, effect};
use crate::matrix;
use crate::memory::{self, Moment};

effect! {
    /// Growth of a link with a temperature that follows the logged one.
    pub struct ThermalLag {
        /// From 1: the body moved by joint N.
        pub link: usize,
        /// Expansion, um per m and K.
        pub um_per_m_k: f64,
        /// Temperature at which the link has its length, C.
        pub reference_c: f64,
        /// Time constant with which its metal follows, s.
        pub lag_s: f64,
        /// That of the core behind the skin, s; half of the growth is the core's. 0: the link is warm throughout.
        #[serde(default)]
        pub core_s: f64,
    }
    "thermal_growth" at link, scaled by um_per_m_k, |self| [("expansion", "um/m/K", self.um_per_m_k), ("lag", "s", self.lag_s)]
}

impl Act for ThermalLag {
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.link - 1;
        let strain = 1e-6 * self.um_per_m_k * state.memory;
        let growth = matrix::shift(matrix::scale(state.arm.links[index].span, strain));
        motion.link_end[index] = matrix::times(&growth, &motion.link_end[index]);
    }
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        let skin = memory::behind(past, self.lag_s, self.reference_c);
        let core = memory::behind(past, self.lag_s + self.core_s, self.reference_c);
        skin.iter()
            .zip(core)
            .map(|(skin, core)| 0.5 * (skin + core) - self.reference_c)
            .collect()
    }
}
