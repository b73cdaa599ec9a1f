//! Somebody knocks against the tracker's stand: to the data the robot's base steps the other way.

use super::{Act, Motion, State, TrueValue, true_value};
use crate::matrix::{self, Vector};
use crate::motion::step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rigid step of what is measured from a moment on, of which a part may settle back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrackerKnock {
    /// Displacement, tracker frame, um.
    #[serde(default)]
    pub shift_um: Vector,
    /// Rotation vector about the tracker's origin, arcsec.
    #[serde(default)]
    pub turn_arcsec: Vector,
    /// The moment since the start of the recording, s.
    pub at_s: f64,
    /// Share of the step that settles back.
    #[serde(default)]
    pub back_share: f64,
    /// Time constant of that, s.
    #[serde(default = "minute")]
    pub back_s: f64,
}

fn minute() -> f64 {
    60.0
}

impl Act for TrackerKnock {
    fn act(&self, state: &State, motion: &mut Motion) {
        let since = state.row.time_s - self.at_s;
        if since >= 0.0 {
            let share = 1.0 - self.back_share * (1.0 - (-since / self.back_s).exp());
            let by = step(self.shift_um, self.turn_arcsec, share);
            motion.tracker = matrix::times(&by, &motion.tracker);
        }
    }
    fn scale(&mut self, by: f64) {
        self.shift_um = matrix::scale(self.shift_um, by);
        self.turn_arcsec = matrix::scale(self.turn_arcsec, by);
    }
    fn truth(&self) -> Vec<TrueValue> {
        // Named by the stand's own numbers: those of the base have another frame.
        let value = |number: &str, unit, value| true_value("base_shift", "stand", "base".into(), number, unit, value);
        vec![
            value("shift", "um", matrix::norm(self.shift_um)),
            value("turn", "arcsec", matrix::norm(self.turn_arcsec)),
            value("at", "s", self.at_s),
        ]
    }
}
