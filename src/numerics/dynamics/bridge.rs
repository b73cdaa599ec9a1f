//! Rows that were lost one or a few at a time: made up between their neighbours, so that filters go on over them.

use super::recording::TorqueRecording;
use crate::error::counted;
use crate::statistics::nearest;
use std::borrow::Cow;

/// Rows lost in a row, at most; a longer gap ends a stretch.
const MOST: usize = 5;
/// Steps before and after a long one that say whether rows are lost there or a row is stamped late.
const AROUND: usize = 2;

/// A recording without small gaps.
pub(super) struct Bridged<'a> {
    pub recording: Cow<'a, TorqueRecording>,
    /// Of each row: the recorded one, or the one before it where it is made up.
    pub origin: Vec<usize>,
}

impl<'a> Bridged<'a> {
    /// Of a checked recording.
    pub fn of(recording: &'a TorqueRecording) -> Self {
        let lost = lost(recording);
        let rows = recording.rows();
        if lost.is_empty() {
            return Self { recording: Cow::Borrowed(recording), origin: (0..rows).collect() };
        }
        let mut origin = Vec::with_capacity(rows + lost.iter().map(|(_, count)| count).sum::<usize>());
        // Of each row: how far it is from its origin to the next recorded row, as a share.
        let mut shares = Vec::with_capacity(origin.capacity());
        let mut next = lost.iter().peekable();
        for row in 0..rows {
            origin.push(row);
            shares.push(0.0);
            if let Some((_, count)) = next.next_if(|(before, _)| *before == row) {
                origin.extend(std::iter::repeat_n(row, *count));
                shares.extend((1..=*count).map(|k| k as f64 / (count + 1) as f64));
            }
        }
        let between = |values: &[f64], width: usize| -> Vec<f64> {
            let row = |(row, share): (&usize, &f64)| {
                let (row, share) = (*row, *share);
                (0..width).map(move |entry| {
                    let now = values[row * width + entry];
                    if share == 0.0 { now } else { now + share * (values[(row + 1) * width + entry] - now) }
                })
            };
            origin.iter().zip(&shares).flat_map(row).collect()
        };
        let n = recording.joints;
        let whole = TorqueRecording {
            joints: n,
            time: between(&recording.time, 1),
            position: between(&recording.position, n),
            velocity: recording.velocity.as_ref().map(|velocity| between(velocity, n)),
            torque: between(&recording.torque, n),
            temperature: recording.temperature.as_ref().map(|temperature| between(temperature, 1)),
            trajectory: origin.iter().map(|row| recording.trajectory[*row]).collect(),
            held_out: origin.iter().map(|row| recording.held_out[*row]).collect(),
            from_current: recording.from_current,
        };
        Self { recording: Cow::Owned(whole), origin }
    }

    /// A sentence where rows are made up.
    pub fn remark(&self, recorded: usize) -> Option<String> {
        let made_up = self.recording.rows() - recorded;
        (made_up > 0)
            .then(|| format!("bridged between their neighbours: {} of the clock without a row", counted(made_up, "step")))
    }
}

/// Rows after which some are lost, and how many.
fn lost(recording: &TorqueRecording) -> Vec<(usize, usize)> {
    let time = &recording.time;
    let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = nearest(&mut steps, 0.5).unwrap_or(1.0);
    let after = |row: usize| {
        let (first, last) = (row.saturating_sub(AROUND), (row + 1 + AROUND).min(time.len() - 1));
        if recording.trajectory[first] != recording.trajectory[last] {
            return None;
        }
        let here = ((time[row + 1] - time[row]) / usual).round() - 1.0;
        let around = ((time[last] - time[first]) / usual).round() - (last - first) as f64;
        let count = here.min(around);
        (count >= 1.0 && count <= MOST as f64).then_some((row, count as usize))
    };
    (0..time.len() - 1).filter_map(after).collect()
}
