//! The cut-off of the low-pass, where none is asked for: from how fast the joints come and go.

use super::clock::RecordingClock;
use super::recording::TorqueRecording;
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
    let mut paces: Vec<f64> = (0..recording.joints).map(|joint| pace(recording, clock, joint)).collect();
    let usual = nearest(&mut paces, 0.5).unwrap_or(0.0);
    (HARMONICS * usual).clamp(LEAST, (MOST * clock.rate).max(LEAST))
}

/// How often a joint comes and goes, Hz: rms of its velocity over rms of its angle about the mean, as of a sine.
fn pace(recording: &TorqueRecording, clock: &RecordingClock, joint: usize) -> f64 {
    let n = recording.joints;
    let step = ((STEP * clock.rate) as usize).max(1);
    let (mut moved, mut apart) = (0.0, 0.0);
    for stretch in clock.stretches.iter().filter(|stretch| stretch.len() > step) {
        let angle = |row: usize| recording.position[row * n + joint];
        let mean = stretch.clone().map(angle).sum::<f64>() / stretch.len() as f64;
        let square: f64 = stretch.clone().map(|row| (angle(row) - mean).powi(2)).sum();
        let moves: f64 = (stretch.start + step..stretch.end)
            .map(|row| ((angle(row) - angle(row - step)) * clock.rate / step as f64).powi(2))
            .sum();
        moved += moves / (stretch.len() - step) as f64 * stretch.len() as f64;
        apart += square;
    }
    if apart > 0.0 { (moved / apart).sqrt() / (2.0 * PI) } else { 0.0 }
}
