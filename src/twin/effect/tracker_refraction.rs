//! Air changes its index of refraction as it warms: ranges scale with the deviation of its temperature, about 1 um/m/K.

use super::{Act, Motion, State, effect};
use crate::matrix::{self, Vector};
use crate::memory::{self, Moment};
use crate::statics::Row;

effect! {
    /// Ranges grow with the temperature of the air along the beam.
    pub struct TrackerRefraction {
        /// um per m and K.
        pub um_per_m_k: f64,
        /// Temperature for which the tracker corrects, C.
        pub reference_c: f64,
        /// Time constant with which the air follows the logged temperature, s; 0: at once.
        #[serde(default)]
        pub lag_s: f64,
        /// The air warms by so much on its own, K, whatever is logged; 0: it follows the log.
        #[serde(default)]
        pub own_rise_k: f64,
        /// Time constant of that, h.
        #[serde(default = "one")]
        pub warm_up_h: f64,
    }
    "tracker_refraction" of "tracker" "tracker", scaled by um_per_m_k,
    |self| [("scale", "um/m/K", self.um_per_m_k), ("lag", "s", self.lag_s)]
}

fn one() -> f64 {
    1.0
}

impl Act for TrackerRefraction {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        if self.own_rise_k != 0.0 {
            let own =
                |time_s: f64| self.own_rise_k * (1.0 - (-time_s / (3600.0 * self.warm_up_h)).exp());
            return past.iter().map(|moment| own(moment.time_s)).collect();
        }
        let air = memory::behind(past, self.lag_s, self.reference_c);
        air.into_iter()
            .map(|celsius| celsius - self.reference_c)
            .collect()
    }
    fn sight(&self, _row: &Row, memory: f64, point: Vector) -> Vector {
        matrix::scale(point, 1.0 + 1e-6 * self.um_per_m_k * memory)
    }
}
