//! Joint positions logged before the arm has settled, or by a clock that is behind: the log holds part of the last move.

use super::{Act, Motion, State, TrueValue, true_value};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The log is behind by a share of the last move.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointLogLag {
    /// Share of the last move that the log lacks.
    pub share: f64,
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
    fn seat(&self) -> Option<usize> {
        self.joint
    }
    fn scale(&mut self, by: f64) {
        self.share *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        vec![true_value("joint_log_lag", "recording", "recording".into(), "share", "1", self.share)]
    }
}
