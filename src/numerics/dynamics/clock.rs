//! The clock of a recording: its rate, and the runs of rows over which a filter may work.

use super::recording::TorqueRecording;
use crate::statistics::nearest;
use std::ops::Range;

/// A step of the clock longer than so many usual ones is a gap.
const GAP: f64 = 1.5;
/// A step of a joint so many times the largest usual one is a jump: trajectories that were cut out and put together.
const JUMP: f64 = 4.0;

/// Rate and runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RecordingClock {
    /// Hz.
    pub rate: f64,
    /// Rows without a gap in time or position, ascending.
    pub stretches: Vec<Range<usize>>,
}

impl RecordingClock {
    /// Of a motion of one trajectory in even steps, s.
    pub fn even(time: &[f64]) -> Self {
        let rows = time.len();
        let rate = (rows - 1) as f64 / (time[rows - 1] - time[0]);
        Self { rate, stretches: std::iter::once(0..rows).collect() }
    }

    /// Of a checked recording.
    pub fn of(recording: &TorqueRecording) -> Self {
        let mut steps: Vec<f64> = recording.time.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let usual = nearest(&mut steps, 0.5).unwrap_or(1.0);
        let n = recording.joints;
        let step =
            |row: usize, joint: usize| (recording.position[row * n + joint] - recording.position[(row - 1) * n + joint]).abs();
        let fastest: Vec<f64> = (0..n)
            .map(|joint| {
                let mut all: Vec<f64> = (1..recording.rows()).map(|row| step(row, joint)).collect();
                nearest(&mut all, 0.999).unwrap_or(0.0)
            })
            .collect();
        let torn = |row: usize| {
            let lasted = recording.time[row] - recording.time[row - 1];
            lasted > GAP * usual || lasted <= 0.0 || (0..n).any(|joint| step(row, joint) > JUMP * fastest[joint] + 1e-12)
        };
        let mut stretches = Vec::new();
        let mut start = 0;
        for row in 1..=recording.rows() {
            if row == recording.rows() || torn(row) {
                stretches.push(start..row);
                start = row;
            }
        }
        Self { rate: 1.0 / usual, stretches }
    }
}
