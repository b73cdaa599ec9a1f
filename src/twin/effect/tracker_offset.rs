//! The tracker's ranges are off: by a dead path or the reflector's constant, by a cyclic part, by the square of the range.

use super::{Act, Motion, State, effect};
use crate::matrix::Vector;
use crate::polar::Polar;
use crate::statics::Row;
use std::f64::consts::TAU;

effect! {
    /// What is added to a range `r`.
    #[serde(default)]
    pub struct TrackerOffset {
        /// um.
        pub constant_um: f64,
        /// Times `sin(2 pi r / wave + phase)`, um: stray light in the meter of distances.
        pub cyclic_um: f64,
        /// Length of the cycle, mm.
        pub wave_mm: f64,
        /// Phase of the cycle at the instrument, deg.
        pub phase_deg: f64,
        /// Times the square of the range, um per m2.
        pub um_per_m2: f64,
    }
    "tracker_offset" of "tracker" "tracker", scaled by constant_um cyclic_um um_per_m2,
    |self| [("constant", "um", self.constant_um), ("cyclic", "um", self.cyclic_um), ("square", "um/m2", self.um_per_m2)]
}

impl Default for TrackerOffset {
    fn default() -> Self {
        Self {
            constant_um: 0.0,
            cyclic_um: 0.0,
            wave_mm: 1000.0,
            phase_deg: 0.0,
            um_per_m2: 0.0,
        }
    }
}

impl Act for TrackerOffset {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn sight(&self, _row: &Row, _memory: f64, point: Vector) -> Vector {
        let seen = Polar::of(point);
        let cycle = (TAU * 1e3 * seen.range / self.wave_mm + self.phase_deg.to_radians()).sin();
        let off =
            self.constant_um + self.cyclic_um * cycle + self.um_per_m2 * seen.range * seen.range;
        Polar {
            range: seen.range + 1e-6 * off,
            ..seen
        }
        .point()
    }
}
