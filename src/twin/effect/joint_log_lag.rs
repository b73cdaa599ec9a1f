//! Joint positions logged before the arm has settled, or by a clock that is behind: the log holds part of the last move.

use super::{Act, Motion, State, Stated, TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The log is behind: by a share of the last move, or by a time while the arm moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointLogLag {
    /// Share of the last move that the log lacks.
    #[serde(default)]
    pub share: f64,
    /// How much later than the joints a point is measured while the arm moves, ms.
    #[serde(default)]
    pub clock_ms: f64,
    /// The joint whose log is behind, from 1; missing: all of them.
    #[serde(default)]
    pub joint: Option<usize>,
}

impl Act for JointLogLag {
    fn act(&self, _state: &State, _motion: &mut Motion) {}
    fn log(&self, q: &mut [f64], before: &[f64]) {
        for (joint, (now, then)) in q.iter_mut().zip(before).enumerate() {
            if self.joint.is_none_or(|only| only == joint + 1) {
                *now -= self.share * (*now - then);
            }
        }
    }
    fn later(&self) -> f64 {
        1e-3 * self.clock_ms
    }
}

impl Stated for JointLogLag {
    fn seat(&self) -> Option<usize> {
        self.joint
    }
    fn scale(&mut self, by: f64) {
        self.share *= by;
        self.clock_ms *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let number = |name, unit, value| {
            true_value(
                "joint_log_lag",
                "recording",
                "recording".into(),
                name,
                unit,
                value,
            )
        };
        let share =
            (self.share != 0.0 || self.clock_ms == 0.0).then(|| number("share", "1", self.share));
        share
            .into_iter()
            .chain((self.clock_ms != 0.0).then(|| number("time", "s", self.later())))
            .collect()
    }
}
