//! What a row remembers of the rows before it: states that follow the order of measurement. Ways between stops are straight.

use crate::robot::measurements::{Key, Measurements};
use std::fmt;
use std::sync::Arc;

/// A state that follows the rows.
#[expect(missing_docs, reason = "a field is documented with its state")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Memory {
    /// Side to which pre-sliding friction has brought a joint: it fades in over a travel (rad or m) after each reversal, -1 to 1 (Dahl).
    Slip { joint: usize, travel: f64 },
    /// How far what sticks beside a joint is stretched by its travel, until it slips at a limit (rad or m): a stop of Prandtl's.
    Stretch { joint: usize, limit: f64 },
    /// Travel of a joint of late (rad or m), which fades with a time (s), as what is viscous yields.
    Recent { joint: usize, time: f64 },
    /// Speed of a joint of late (rad/s or m/s), forgotten with a cooling time (s).
    Work { joint: usize, cooling: f64 },
    /// The recorded temperature (C) behind a time constant (s).
    Temperature { lag: f64 },
}

impl Memory {
    fn key(self) -> Key {
        match self {
            Self::Slip { joint, travel } => (0, joint, travel.to_bits()),
            Self::Work { joint, cooling } => (1, joint, cooling.to_bits()),
            Self::Temperature { lag } => (2, 0, lag.to_bits()),
            Self::Stretch { joint, limit } => (3, joint, limit.to_bits()),
            Self::Recent { joint, time } => (4, joint, time.to_bits()),
        }
    }

    /// The state at every row.
    fn along(self, data: &Measurements) -> Arc<[f64]> {
        let mut states = vec![0.0; data.rows()];
        let mut state = match self {
            _ if data.rows() == 0 => 0.0,
            Self::Temperature { .. } => data.temperature(data.at_place(0)).unwrap_or(0.0),
            Self::Slip { joint, .. } => data
                .recorded_direction(data.at_place(0), joint)
                .unwrap_or(0.0),
            Self::Work { .. } | Self::Stretch { .. } | Self::Recent { .. } => 0.0,
        };
        for place in 0..data.rows() {
            let row = data.at_place(place);
            if place > 0 {
                state = self.next(data, state, [data.at_place(place - 1), row]);
            }
            states[row] = state;
        }
        states.into()
    }

    /// The state after the way from one row to the next.
    fn next(self, data: &Measurements, state: f64, [from, to]: [usize; 2]) -> f64 {
        let moved = |joint: usize| data.q(to)[joint] - data.q(from)[joint];
        let time = (data.time(to) - data.time(from)).max(0.0);
        match self {
            Self::Slip { joint, travel } => {
                let (moved, recorded) = (moved(joint), data.recorded_direction(to, joint));
                match recorded {
                    // It came from elsewhere than the row before: nobody knows how far.
                    Some(side) if side * moved < 0.0 => side,
                    _ if moved == 0.0 => state,
                    _ => {
                        moved.signum() + (state - moved.signum()) * libm::exp(-moved.abs() / travel)
                    }
                }
            }
            Self::Stretch { joint, limit } => {
                match (moved(joint), data.recorded_direction(to, joint)) {
                    // It came from elsewhere than the row before, far enough to slip.
                    (moved, Some(side)) if side * moved < 0.0 => side * limit,
                    (moved, _) => (state + moved).clamp(-limit, limit),
                }
            }
            Self::Recent { joint, time: fades } => state * libm::exp(-time / fades) + moved(joint),
            Self::Work { .. } | Self::Temperature { .. } if time == 0.0 => state,
            Self::Work { joint, cooling } => {
                let left = libm::exp(-time / cooling);
                state * left + moved(joint).abs() / time * (1.0 - left)
            }
            Self::Temperature { lag } => {
                let [before, now] = [from, to].map(|row| data.temperature(row).unwrap_or(state));
                // Behind a steady rise by rate times lag, in the end.
                let behind = (now - before) / time * lag;
                now - behind + (state - before + behind) * libm::exp(-time / lag)
            }
        }
    }
}

impl Measurements {
    /// A state at a row.
    pub(crate) fn memory(&self, memory: Memory, row: usize) -> f64 {
        self.memories.of(memory.key(), row, || memory.along(self))
    }
}

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
    pub fn beyond(&self, q: &[f64], payload: f64, temperature: Option<f64>) -> Vec<Unmeasured> {
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

/// The least and the greatest of some values; upside down of none.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[lower, upper], value| [lower.min(value), upper.max(value)],
    )
}

#[cfg(test)]
mod visited_tests {
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
        let row_of = |q: [f64; 2], payload, temperature| {
            let beyond = visited.beyond(&q, payload, temperature);
            beyond
                .iter()
                .map(ToString::to_string)
                .collect::<Vec<_>>()
                .join("; ")
        };
        assert_eq!(row_of([0.2, 0.3], 5.0, Some(22.0)), "");
        assert_eq!(
            row_of([0.5, 0.6], 5.0, None),
            "joint 1, 2 beyond the measured range"
        );
        assert_eq!(
            row_of([-0.4, 0.1], 5.0, Some(25.5)),
            "joint 1 in a gap of the measured range"
        );
        assert_eq!(
            row_of([0.2, 0.3], 20.0, Some(40.0)),
            "payload beyond the measured range; temperature beyond the measured range"
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(q: &[f64], time: &[f64], temperature: &[f64]) -> Measurements {
        let (q, time, temperature) = (q.to_vec(), Some(time.to_vec()), Some(temperature.to_vec()));
        Measurements {
            joints: 1,
            q,
            time,
            temperature,
            ..Measurements::default()
        }
    }

    #[test]
    fn what_is_remembered_of_travel_follows_the_way_from_row_to_row() {
        // Friction before sliding fades in over a travel after each reversal; what sticks is stretched to its limit and relaxes only by the way
        // back; travel of late fades with time.
        let (slip, stretch, recent) = (
            Memory::Slip {
                joint: 0,
                travel: 0.2,
            },
            Memory::Stretch {
                joint: 0,
                limit: 0.3,
            },
            Memory::Recent {
                joint: 0,
                time: 10.0,
            },
        );
        let after = |travelled: f64| -1.0 + 2.0 * (-travelled / 0.2).exp();
        let faded = [(-1.0f64).exp(), (-2.0f64).exp() - 0.5];
        let cases: [(Memory, &[[f64; 3]]); 3] = [
            (
                slip,
                &[
                    [0.0, 0.0, 0.0],
                    [1.0, 10.0, 1.0],
                    [2.0, 9.9, after(0.1)],
                    [3.0, 9.9, after(0.1)],
                    [4.0, 9.7, after(0.3)],
                ],
            ),
            (
                stretch,
                &[
                    [0.0, 0.0, 0.0],
                    [1.0, 0.2, 0.2],
                    [2.0, 1.0, 0.3],
                    [3.0, 0.9, 0.2],
                    [4.0, 0.9, 0.2],
                    [5.0, 0.0, -0.3],
                ],
            ),
            (
                recent,
                &[
                    [0.0, 0.0, 0.0],
                    [1.0, 1.0, 1.0],
                    [11.0, 1.0, faded[0]],
                    [21.0, 0.5, faded[1]],
                ],
            ),
        ];
        for (memory, rows) in cases {
            let column = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
            let data = recording(&column(1), &column(0), &vec![20.0; rows.len()]);
            for (row, [.., expected]) in rows.iter().enumerate() {
                let found = data.memory(memory, row);
                assert!(
                    (found - expected).abs() < 1e-12,
                    "{memory:?} at {row}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn a_lagging_temperature_is_behind_a_steady_rise_by_its_time_constant() {
        let time: Vec<f64> = (0..200).map(f64::from).collect();
        let rising: Vec<f64> = time.iter().map(|time| 20.0 + 0.1 * time).collect();
        let data = recording(&[0.0; 200], &time, &rising);
        let late = data.memory(Memory::Temperature { lag: 10.0 }, 199);
        assert!((late - (rising[199] - 1.0)).abs() < 1e-6, "{late}");
    }

    #[test]
    fn work_is_the_speed_of_late() {
        let time: Vec<f64> = (0..100).map(|k| 2.0 * f64::from(k)).collect();
        let there_and_back: Vec<f64> = (0..100).map(|k| f64::from(k % 2)).collect();
        let data = recording(&there_and_back, &time, &[20.0; 100]);
        let work = |row: usize| {
            data.memory(
                Memory::Work {
                    joint: 0,
                    cooling: 20.0,
                },
                row,
            )
        };
        let expected = |row: f64| 0.5 * (1.0 - (-row / 10.0).exp());
        assert!(
            [0, 5, 99]
                .into_iter()
                .all(|row| (work(row) - expected(row as f64)).abs() < 1e-9)
        );
    }
}
