//! The frequency up to which positions and torques are of one motion. Above it the quantisation of the encoder, twice differentiated, dominates:
//! inverse dynamics of the positions gives far more torque than was recorded, and the recorded torque is the controller's response to it.

use super::arm::DynamicArm;
use super::recording::{RecordingClock, TorqueRecording, column};
use super::scene::DynamicScene;
use crate::criteria::torque::{BEYOND, STANDS};
use crate::statistics::nearest;
use std::f64::consts::TAU;

/// s of a window.
const WINDOW: f64 = 2.0;
/// Hz, the lowest that is asked for, and the lowest cut-off.
const LOWEST: f64 = 3.0;
/// Frequencies that are asked for, at most.
const ASKED: usize = 40;
/// Windows that say something.
const FEWEST: usize = 5;

/// Hz, at most `cutoff`, up to which the recorded torques stand above what they are where the torques of the declared masses are far above them,
/// at most joints; none where nothing is declared, or where these are not far above at the cut-off either.
pub(super) fn common(
    arm: &DynamicArm,
    recording: &TorqueRecording,
    clock: &RecordingClock,
    cutoff: f64,
) -> Option<f64> {
    arm.links.as_ref()?;
    let windows = windows(clock);
    if windows.len() < FEWEST || cutoff <= LOWEST {
        return None;
    }
    let scene = DynamicScene::new(arm, recording, clock, cutoff, false);
    let step = ((cutoff - LOWEST) / ASKED as f64).max(1.0 / WINDOW);
    let count = ((cutoff - LOWEST) / step) as usize;
    let asked: Vec<f64> = (0..=count).map(|k| LOWEST + step * k as f64).collect();
    let limit = |joint: usize| {
        let torque = column(&recording.torque, recording.joints, joint);
        let power = |course: &[f64]| spectrum(course, &windows, clock.rate, &asked);
        let (rigid, torque) = (power(&scene.rigid[joint]), power(&torque));
        let is_beyond = |k: &usize| rigid[*k] > *BEYOND * torque[*k];
        let Some(beyond) = (0..asked.len()).rev().take_while(is_beyond).last() else {
            return cutoff;
        };
        let made = nearest(&mut torque[beyond..].to_vec(), 0.5).unwrap_or(0.0);
        let stands = |k: &usize| torque[*k] > *STANDS * made;
        let last = (0..beyond).take_while(stands).last();
        asked[last.unwrap_or(0)]
    };
    let mut limits: Vec<f64> = (0..recording.joints).map(limit).collect();
    nearest(&mut limits, 0.5).filter(|limit| *limit < cutoff)
}

/// What is said of a cut-off that is lower for it.
pub(super) fn remark(common: f64, usual: f64) -> String {
    format!(
        "the encoder's quantisation dominates below the usual low-pass of {usual:.1} Hz: the torque that the positions need there is far more than was \
         recorded; the low-pass is at {common:.1} Hz (`cutoff_hz` sets another)"
    )
}

/// First rows of windows that overlap by half, and their length.
fn windows(clock: &RecordingClock) -> Vec<std::ops::Range<usize>> {
    let long = (WINDOW * clock.rate) as usize;
    let of_stretch = |stretch: &std::ops::Range<usize>| {
        let starts = stretch.clone().step_by((long / 2).max(1));
        let end = stretch.end;
        starts
            .map(move |start| start..start + long)
            .filter(move |window| window.end <= end)
    };
    clock.stretches.iter().flat_map(of_stretch).collect()
}

/// Power of a course at some frequencies, over windows of a squared sine.
fn spectrum(
    course: &[f64],
    windows: &[std::ops::Range<usize>],
    rate: f64,
    asked: &[f64],
) -> Vec<f64> {
    let long = windows[0].len() as f64;
    let power = |frequency: &f64| {
        // A phase that is turned on from row to row.
        let (turn_sine, turn_cosine) = (TAU * frequency / rate).sin_cos();
        let (bell_sine, bell_cosine) = (TAU / long).sin_cos();
        let of_window = |window: &std::ops::Range<usize>| {
            let mean = course[window.clone()].iter().sum::<f64>() / long;
            let (mut cosine, mut sine, mut bell) = (1.0, 0.0, (1.0, 0.0));
            let (mut real, mut imaginary) = (0.0, 0.0);
            for value in &course[window.clone()] {
                let weighed = (value - mean) * (1.0 - bell.0);
                real += weighed * cosine;
                imaginary += weighed * sine;
                (cosine, sine) = (
                    cosine * turn_cosine - sine * turn_sine,
                    sine * turn_cosine + cosine * turn_sine,
                );
                bell = (
                    bell.0 * bell_cosine - bell.1 * bell_sine,
                    bell.1 * bell_cosine + bell.0 * bell_sine,
                );
            }
            real * real + imaginary * imaginary
        };
        windows.iter().map(of_window).sum()
    };
    asked.iter().map(power).collect()
}

#[cfg(test)]
mod tests {
    use super::super::cases::{arm, record_at};
    use super::*;

    /// Noise of the torques, Nm, and counts of the encoders, rad.
    fn limit(counts: f64) -> Option<f64> {
        let arm = arm();
        let mut recording = record_at(&arm, 200.0, 0.0, &|_| 0.0);
        let round = |angle: &mut f64| *angle = (*angle / counts).round() * counts;
        recording.position.iter_mut().for_each(round);
        let clock = RecordingClock::of(&recording);
        common(&arm, &recording, &clock, 20.0)
    }

    #[test]
    fn counts_of_an_encoder_end_what_positions_and_torques_have_in_common() {
        assert_eq!(limit(1e-6), None);
        let coarse = limit(1.5e-3).expect("counts are seen below 20 Hz");
        assert!((3.0..15.0).contains(&coarse), "{coarse} Hz");
    }
}
