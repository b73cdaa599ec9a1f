//! Where a model was measured: ranges of joints, payload and temperature, and gaps inside the ranges that no row visited.

use super::measurements::Measurements;
use std::fmt;

/// How far beyond the measured range a value still counts as inside, as a share of the range.
const SLACK: f64 = 0.02;
/// A stretch of a joint (20 deg in rad; m) without rows is a gap: what repeats with the angle may do anything there ...
const GAP: f64 = 0.35;
/// ... unless rows are so few that evenly drawn ones leave half of it by chance: of n in a range r, r ln n / n.
const CHANCE: f64 = 2.0;

/// What was visited.
#[derive(Debug, Clone, PartialEq)]
pub struct Visited {
    joints: Vec<Joint>,
    /// kg.
    payload: [f64; 2],
    /// C.
    temperature: Option<[f64; 2]>,
}

/// rad or m.
#[derive(Debug, Clone, PartialEq)]
struct Joint {
    range: [f64; 2],
    gaps: Vec<[f64; 2]>,
}

impl Visited {
    /// What some rows visited.
    pub fn of(data: &Measurements, rows: &[usize]) -> Self {
        let joint = |j: usize| Joint::of(rows.iter().map(|row| data.q(*row)[j]).collect());
        let temperature = |all: &Vec<f64>| {
            range(
                rows.iter()
                    .map(|row| all[*row])
                    .filter(|value| value.is_finite()),
            )
        };
        Self {
            joints: (0..data.joints).map(joint).collect(),
            payload: range(rows.iter().map(|row| data.payload[*row])),
            temperature: data
                .temperature
                .as_ref()
                .map(temperature)
                .filter(|range| range[0] <= range[1]),
        }
    }

    /// What of a pose, its payload (kg) and its temperature (C) was never measured; empty inside.
    pub(crate) fn beyond(
        &self,
        q: &[f64],
        payload: f64,
        temperature: Option<f64>,
    ) -> Vec<Unmeasured> {
        let outside = |value: f64, [lower, upper]: [f64; 2], least: f64| {
            let slack = (SLACK * (upper - lower)).max(least);
            value < lower - slack || value > upper + slack
        };
        let mut out = Vec::new();
        let joints = |is: &dyn Fn(f64, &Joint) -> bool| -> Vec<usize> {
            (0..)
                .zip(q.iter().zip(&self.joints))
                .filter(|(_, (q, joint))| is(**q, joint))
                .map(|(number, _)| number)
                .collect()
        };
        let beyond = joints(&|q, joint| outside(q, joint.range, 1e-3));
        out.extend((!beyond.is_empty()).then_some(Unmeasured::Joints(beyond)));
        let between = joints(&|q, joint| joint.is_in_gap(q));
        out.extend((!between.is_empty()).then_some(Unmeasured::Gaps(between)));
        if outside(payload, self.payload, 0.05 * self.payload[1].abs()) {
            out.push(Unmeasured::Payload);
        }
        if let (Some(now), Some(range)) = (temperature, self.temperature)
            && outside(now, range, 1.0)
        {
            out.push(Unmeasured::Temperature);
        }
        out
    }
}

impl Joint {
    fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let (count, range) = (values.len() as f64, range(values.iter().copied()));
        let least = GAP.max(CHANCE * (range[1] - range[0]) * count.ln() / count);
        let gaps = values
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > least)
            .map(|pair| [pair[0], pair[1]])
            .collect();
        Self { range, gaps }
    }

    fn is_in_gap(&self, q: f64) -> bool {
        let slack = (SLACK * (self.range[1] - self.range[0])).max(1e-3);
        self.gaps
            .iter()
            .any(|[low, high]| q > low + slack && q < high - slack)
    }
}

/// What of a pose and its circumstances lies outside of what was measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unmeasured {
    /// Joints, from 0, beyond their range.
    Joints(Vec<usize>),
    /// Joints, from 0, where no row was inside their range.
    Gaps(Vec<usize>),
    /// Declared payload, kg.
    Payload,
    /// Recorded temperature, C.
    Temperature,
}

impl fmt::Display for Unmeasured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joints(joints) => {
                write!(f, "joint {} beyond the measured range", numbered(joints))
            }
            Self::Gaps(joints) => write!(
                f,
                "joint {} in a gap of the measured range",
                numbered(joints)
            ),
            Self::Payload => f.write_str("payload beyond the measured range"),
            Self::Temperature => f.write_str("temperature beyond the measured range"),
        }
    }
}

/// Joints, from 0, as people count them: `3, 5`.
pub fn numbered(joints: &[usize]) -> String {
    joints
        .iter()
        .map(|joint| (joint + 1).to_string())
        .collect::<Vec<_>>()
        .join(", ")
}

fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[lower, upper], value| [lower.min(value), upper.max(value)],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_visited_is_named() {
        let q = [[-1.0, 0.0], [-0.9, 0.5], [0.1, 0.2], [0.3, 0.4]];
        let data = Measurements {
            joints: 2,
            q: q.concat(),
            payload: vec![0.0, 0.0, 10.0, 10.0],
            temperature: Some(vec![20.0, f64::NAN, 24.0, 25.0]),
            ..Measurements::default()
        };
        let visited = Visited::of(&data, &[0, 1, 2, 3]);
        let said = |q: [f64; 2], payload, temperature| {
            let beyond = visited.beyond(&q, payload, temperature);
            beyond
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("; ")
        };
        assert_eq!(said([0.2, 0.3], 5.0, Some(22.0)), "");
        assert_eq!(
            said([0.5, 0.6], 5.0, None),
            "joint 1, 2 beyond the measured range"
        );
        assert_eq!(
            said([-0.4, 0.1], 5.0, Some(25.5)),
            "joint 1 in a gap of the measured range"
        );
        assert_eq!(
            said([0.2, 0.3], 20.0, Some(40.0)),
            "payload beyond the measured range; temperature beyond the measured range"
        );
    }
}
