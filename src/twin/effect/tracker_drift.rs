//! The tracker's stand creeps, and the base frame with it as the tracker sees it.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::twin::matrix::{self, Vector};
use crate::twin::truth::ARCSEC;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A creep that slows down: `1 - exp(-t/settling)` of a final motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackerDrift {
    /// Final displacement of what is measured, tracker frame, um.
    #[serde(default)]
    pub shift_um: Vector,
    /// Its final rotation vector about the tracker's origin, arcsec.
    #[serde(default)]
    pub turn_arcsec: Vector,
    /// Time constant, h.
    pub settling_h: f64,
}

impl Act for TrackerDrift {
    fn act(&self, state: &State, motion: &mut Motion) {
        let share = 1.0 - (-state.row.time_s / (3600.0 * self.settling_h)).exp();
        let moved = matrix::shift(matrix::scale(self.shift_um, 1e-6 * share));
        let turned = matrix::turn_by(matrix::scale(self.turn_arcsec, ARCSEC * share));
        motion.tracker = matrix::times(&matrix::times(&moved, &turned), &motion.tracker);
    }
    fn seat(&self) -> Option<usize> {
        None
    }
    fn truth(&self) -> Vec<TrueValue> {
        let axes = ["x", "y", "z"].into_iter().enumerate();
        axes.flat_map(|(index, axis)| {
            let value =
                |number: String, unit, value| true_value("tracker_drift", "tracker", "tracker".into(), &number, unit, value);
            [
                value(format!("shift_{axis}"), "um", self.shift_um[index]),
                value(format!("turn_{axis}"), "arcsec", self.turn_arcsec[index]),
            ]
        })
        .collect()
    }
}
