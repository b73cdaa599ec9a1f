//! The clock of a recording: its rate, and the runs of rows over which a filter may work.

use crate::statistics::nearest;
use crate::types::TorqueRecording;
use std::f64::consts::PI;
use std::ops::Range;

/// A step of the clock longer than so many usual ones is a gap.
const GAP: f64 = 1.5;
/// A step of a joint so many times the largest usual one is a jump: trajectories that were cut out and put together.
const JUMP: f64 = 4.0;

/// Rate and runs.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RecordingClock {
    /// Hz.
    pub(crate) rate: f64,
    /// Rows without a gap in time or position, ascending.
    pub(crate) stretches: Vec<Range<usize>>,
}

impl RecordingClock {
    /// The clock of a motion of one trajectory in even steps, s.
    pub(crate) fn even(time: &[f64]) -> Self {
        let rows = time.len();
        let rate = (rows - 1) as f64 / (time[rows - 1] - time[0]);
        Self {
            rate,
            stretches: std::iter::once(0..rows).collect(),
        }
    }

    /// The clock of a checked recording.
    pub(crate) fn of(recording: &TorqueRecording) -> Self {
        Self::paced(recording, &ClockPace::of(recording))
    }

    /// The clock of rows of a recording whose pace is known.
    pub(crate) fn paced(recording: &TorqueRecording, pace: &ClockPace) -> Self {
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
    pub(crate) usual: f64,
    /// rad from row to row, per joint: 999 of 1000 steps are shorter.
    pub(crate) fastest: Vec<f64>,
}

impl ClockPace {
    /// The pace of a checked recording.
    pub(crate) fn of(recording: &TorqueRecording) -> Self {
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
    pub(crate) fn usual_step(recording: &TorqueRecording) -> f64 {
        let mut steps: Vec<f64> = recording
            .time
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        nearest(&mut steps, 0.5).unwrap_or(1.0)
    }

    /// Whether clock or joints jump before a row, which is not the first one.
    pub(crate) fn is_torn(&self, recording: &TorqueRecording, row: usize) -> bool {
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

// The cut-off of the low-pass, where none is asked for: from how fast the joints come and go.

/// Friction that turns with a joint's direction needs so many harmonics of how often the joint comes and goes.
const HARMONICS: f64 = 60.0;
/// Hz, at least: joints swing faster than they are moved.
const LEAST: f64 = 10.0;
/// At most this share of the rate.
const LARGEST: f64 = 0.1;
/// s over which a velocity is taken: beyond the steps of encoders.
const STEP: f64 = 0.02;

/// Hz; the rate of the clock still bounds it.
pub(super) fn cutoff(recording: &TorqueRecording, clock: &RecordingClock) -> f64 {
    let mut pace = MotionPace::new(recording.joints);
    pace.push(recording, clock, false);
    pace.cutoff(clock.rate)
}

/// How often joints come and go, gathered over rows that may be read in blocks.
pub(super) struct MotionPace {
    joints: Vec<JointPace>,
}

/// The sums of one joint.
#[derive(Debug, Clone, Copy, Default)]
struct JointPace {
    /// Squared velocity, and squared angle about the mean of its stretch, summed over rows of all stretches that have ended.
    ended: [f64; 2],
    /// Sums of the present stretch: rows, mean angle and squares about it; rows of which a velocity is known, and its squares.
    rows: f64,
    mean: f64,
    apart: f64,
    moving: f64,
    moved: f64,
}

impl JointPace {
    /// Takes rows of the present stretch: angles (rad) at `rate` Hz, velocities over so many rows.
    fn push(&mut self, angles: &[f64], rate: f64, step: usize) {
        let rows = angles.len() as f64;
        let mean = angles.iter().sum::<f64>() / rows;
        let away = mean - self.mean;
        let share = rows / (self.rows + rows);
        self.apart += angles
            .iter()
            .map(|angle| (angle - mean).powi(2))
            .sum::<f64>()
            + away * away * self.rows * share;
        self.mean += away * share;
        self.rows += rows;
        let later = angles.get(step..).unwrap_or_default();
        self.moved += angles
            .iter()
            .zip(later)
            .map(|(from, to)| ((to - from) * rate / step as f64).powi(2))
            .sum::<f64>();
        self.moving += later.len() as f64;
    }

    fn end_stretch(&mut self) {
        let [moved, apart] = self.ended;
        let known = self.moving > 0.0;
        let ended = if known {
            [
                moved + self.moved / self.moving * self.rows,
                apart + self.apart,
            ]
        } else {
            self.ended
        };
        *self = Self {
            ended,
            ..Self::default()
        };
    }
}

impl MotionPace {
    /// The sums of no rows of n joints.
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            joints: vec![JointPace::default(); joints],
        }
    }

    /// Takes rows; whether the first stretch of them continues the last one of those before.
    pub(crate) fn push(
        &mut self,
        recording: &TorqueRecording,
        clock: &RecordingClock,
        continues: bool,
    ) {
        let step = ((STEP * clock.rate) as usize).max(1);
        for (joint, pace) in self.joints.iter_mut().enumerate() {
            let angles = column(&recording.position, recording.joints, joint);
            for (place, stretch) in clock.stretches.iter().enumerate() {
                if place > 0 || !continues {
                    pace.end_stretch();
                }
                pace.push(&angles[stretch.clone()], clock.rate, step);
            }
        }
    }

    /// Hz, for a clock of `rate` Hz. A joint comes and goes as often as a sine of the same rms of velocity and of angle.
    pub(crate) fn cutoff(mut self, rate: f64) -> f64 {
        self.joints.iter_mut().for_each(JointPace::end_stretch);
        let often = |[moved, apart]: [f64; 2]| {
            if apart > 0.0 {
                (moved / apart).sqrt() / (2.0 * PI)
            } else {
                0.0
            }
        };
        let mut paces: Vec<f64> = self.joints.iter().map(|joint| often(joint.ended)).collect();
        let usual = nearest(&mut paces, 0.5).unwrap_or(0.0);
        (HARMONICS * usual).clamp(LEAST, (LARGEST * rate).max(LEAST))
    }
}

/// One column of row-major values.
pub(super) fn column(values: &[f64], n: usize, joint: usize) -> Vec<f64> {
    values.iter().skip(joint).step_by(n).copied().collect()
}
