//! Shapes of drawn effects: smooth, with corners, with jumps, straight.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A function of 0 to 1.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForeignShape {
    /// From -1 to 1: for what has two values only.
    Straight,
    /// Sum of `amplitude cos(rate x + phase)`, rows of amplitude, rate (rad) and phase (rad).
    Smooth(Vec<[f64; 3]>),
    /// Straight pieces between points (x, value) with rising x; outside of them the nearest value.
    Corners(Vec<[f64; 2]>),
    /// Steps: pairs (x, value) with rising x, the value from that x on; 0 before the first.
    Jumps(Vec<[f64; 2]>),
}

impl ForeignShape {
    /// At `x`.
    pub(super) fn value(&self, x: f64) -> f64 {
        match self {
            Self::Straight => 2.0 * x - 1.0,
            Self::Smooth(waves) => waves
                .iter()
                .map(|[amplitude, rate, phase]| amplitude * (rate * x + phase).cos())
                .sum(),
            Self::Corners(points) => {
                let after = points
                    .iter()
                    .position(|[at, _]| *at > x)
                    .unwrap_or(points.len());
                match (
                    after.checked_sub(1).and_then(|before| points.get(before)),
                    points.get(after),
                ) {
                    (Some([from, low]), Some([to, high])) => {
                        low + (high - low) * (x - from) / (to - from)
                    }
                    (Some([_, value]), None) | (None, Some([_, value])) => *value,
                    (None, None) => 0.0,
                }
            }
            Self::Jumps(steps) => steps
                .iter()
                .rev()
                .find(|[at, _]| *at <= x)
                .map_or(0.0, |[_, value]| *value),
        }
    }
}
