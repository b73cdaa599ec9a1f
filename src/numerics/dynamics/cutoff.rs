//! The cut-off of the low-pass, where none is asked for: from how fast the joints come and go.

use super::clock::RecordingClock;
use super::recording::TorqueRecording;
use super::scene::column;
use crate::statistics::nearest;
use std::f64::consts::PI;

/// Friction that turns with a joint's direction needs so many harmonics of how often the joint comes and goes.
const HARMONICS: f64 = 60.0;
/// Hz, at least: joints swing faster than they are moved.
const LEAST: f64 = 10.0;
/// At most this share of the rate.
const MOST: f64 = 0.1;
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
    pub fn new(joints: usize) -> Self {
        Self {
            joints: vec![JointPace::default(); joints],
        }
    }

    /// Takes rows; whether the first stretch of them continues the last one of those before.
    pub fn push(&mut self, recording: &TorqueRecording, clock: &RecordingClock, continues: bool) {
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
    pub fn cutoff(mut self, rate: f64) -> f64 {
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
        (HARMONICS * usual).clamp(LEAST, (MOST * rate).max(LEAST))
    }
}
