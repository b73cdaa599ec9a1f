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
    /// The clock of a motion of one trajectory in even steps, s.
    pub fn even(time: &[f64]) -> Self {
        let rows = time.len();
        let rate = (rows - 1) as f64 / (time[rows - 1] - time[0]);
        Self {
            rate,
            stretches: std::iter::once(0..rows).collect(),
        }
    }

    /// The clock of a checked recording.
    pub fn of(recording: &TorqueRecording) -> Self {
        Self::paced(recording, &ClockPace::of(recording))
    }

    /// The clock of rows of a recording whose pace is known.
    pub fn paced(recording: &TorqueRecording, pace: &ClockPace) -> Self {
        let mut stretches = Vec::new();
        let mut start = 0;
        for row in 1..=recording.rows() {
            if row == recording.rows() || pace.is_torn(recording, row) {
                stretches.push(start..row);
                start = row;
            }
        }
        Self {
            rate: 1.0 / pace.usual,
            stretches,
        }
    }
}

/// How fast rows come, and how far joints go from row to row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ClockPace {
    /// s from row to row, median.
    pub usual: f64,
    /// rad from row to row, per joint: 999 of 1000 steps are shorter.
    pub fastest: Vec<f64>,
}

impl ClockPace {
    /// The pace of a checked recording.
    pub fn of(recording: &TorqueRecording) -> Self {
        let fastest = |joint: usize| {
            let mut all: Vec<f64> = (1..recording.rows())
                .map(|row| step(recording, row, joint))
                .collect();
            nearest(&mut all, 0.999).unwrap_or(0.0)
        };
        Self {
            usual: Self::usual_step(recording),
            fastest: (0..recording.joints).map(fastest).collect(),
        }
    }

    /// s from row to row, median.
    pub fn usual_step(recording: &TorqueRecording) -> f64 {
        let mut steps: Vec<f64> = recording
            .time
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        nearest(&mut steps, 0.5).unwrap_or(1.0)
    }

    /// Whether clock or joints jump before a row, which is not the first one.
    pub fn is_torn(&self, recording: &TorqueRecording, row: usize) -> bool {
        let lasted = recording.time[row] - recording.time[row - 1];
        let jumps =
            |(joint, fastest): (usize, &f64)| step(recording, row, joint) > JUMP * fastest + 1e-12;
        lasted > GAP * self.usual || lasted <= 0.0 || self.fastest.iter().enumerate().any(jumps)
    }
}

/// rad from the row before.
fn step(recording: &TorqueRecording, row: usize, joint: usize) -> f64 {
    let n = recording.joints;
    (recording.position[row * n + joint] - recording.position[(row - 1) * n + joint]).abs()
}
