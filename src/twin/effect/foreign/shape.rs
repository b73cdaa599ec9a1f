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
            Self::Smooth(waves) => waves.iter().map(|[amplitude, rate, phase]| amplitude * (rate * x + phase).cos()).sum(),
            Self::Corners(points) => {
                let after = points.iter().position(|[at, _]| *at > x).unwrap_or(points.len());
                match (after.checked_sub(1).and_then(|before| points.get(before)), points.get(after)) {
                    (Some([from, low]), Some([to, high])) => low + (high - low) * (x - from) / (to - from),
                    (Some([_, value]), None) | (None, Some([_, value])) => *value,
                    (None, None) => 0.0,
                }
            }
            Self::Jumps(steps) => steps.iter().rev().find(|[at, _]| *at <= x).map_or(0.0, |[_, value]| *value),
        }
    }

    /// Its stretch between two values as a function of 0 to 1.
    pub(super) fn part(&self, [from, to]: [f64; 2]) -> Self {
        let width = to - from;
        let points = |all: &[[f64; 2]]| all.iter().map(|[at, value]| [(at - from) / width, *value]).collect();
        match self {
            Self::Straight => Self::Corners(vec![[0.0, self.value(from)], [1.0, self.value(to)]]),
            Self::Smooth(waves) => Self::Smooth(
                waves.iter().map(|[amplitude, rate, phase]| [*amplitude, rate * width, rate * from + phase]).collect(),
            ),
            Self::Corners(all) => Self::Corners(points(all)),
            Self::Jumps(all) => Self::Jumps(points(all)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_a_shape_is_the_shape_between_its_ends() {
        let shapes = [
            ForeignShape::Straight,
            ForeignShape::Smooth(vec![[0.7, 9.0, 1.0], [-0.4, 21.0, 2.5]]),
            ForeignShape::Corners(vec![[0.0, 1.0], [0.3, -2.0], [0.8, 0.5], [1.0, 0.0]]),
            ForeignShape::Jumps(vec![[0.2, 1.0], [0.55, -1.0]]),
        ];
        for shape in shapes {
            let part = shape.part([0.25, 0.6]);
            for step in 0..=20 {
                let share = 0.05 * f64::from(step);
                let [whole, own] = [shape.value(0.25 + 0.35 * share), part.value(share)];
                assert!((whole - own).abs() < 1e-12, "{shape:?} at {share}");
            }
        }
    }
}
