//! Rows that were lost one or a few at a time: made up between their neighbours, so that filters go on over them.

use super::clock::ClockPace;
use crate::error::counted;
use crate::types::TorqueRecording;

/// Rows lost in a row, at most; a longer gap ends a stretch.
const LIMIT: usize = 5;
/// Steps before and after a long one that say whether rows are lost there or a row is stamped late.
const AROUND: usize = 2;

/// A recording without small gaps.
pub(super) struct Bridged {
    pub(crate) recording: TorqueRecording,
    /// The recorded row of each, or the one before it where it is made up.
    pub(crate) origin: Vec<usize>,
}

impl Bridged {
    /// Bridges the gaps of a checked recording.
    pub(crate) fn of(recording: TorqueRecording) -> Self {
        let usual = ClockPace::usual_step(&recording);
        Self::by_steps(recording, usual)
    }

    /// The same of rows that usually come every so many s.
    pub(crate) fn by_steps(recording: TorqueRecording, usual: f64) -> Self {
        let lost = lost(&recording, usual);
        let rows = recording.rows();
        if lost.is_empty() {
            return Self {
                recording,
                origin: (0..rows).collect(),
            };
        }
        let mut origin =
            Vec::with_capacity(rows + lost.iter().map(|(_, count)| count).sum::<usize>());
        // How far each row is from its origin to the next recorded row, as a share, and steps of the clock between these.
        let mut shares = Vec::with_capacity(origin.capacity());
        let mut next = lost.iter().peekable();
        for row in 0..rows {
            origin.push(row);
            shares.push((0.0, 1.0));
            if let Some((_, count)) = next.next_if(|(before, _)| *before == row) {
                origin.extend(std::iter::repeat_n(row, *count));
                let steps = (count + 1) as f64;
                shares.extend((1..=*count).map(|k| (k as f64 / steps, steps)));
            }
        }
        let between = |values: &[f64], width: usize| -> Vec<f64> {
            let row = |(row, (share, steps)): (&usize, &(f64, f64))| {
                let weights = weights(&recording, *row, *share, *steps);
                (0..width).map(move |entry| {
                    weights
                        .iter()
                        .map(|(at, weight)| weight * values[at * width + entry])
                        .sum()
                })
            };
            origin.iter().zip(&shares).flat_map(row).collect()
        };
        let n = recording.joints;
        let whole = TorqueRecording {
            joints: n,
            time: between(&recording.time, 1),
            position: between(&recording.position, n),
            velocity: recording
                .velocity
                .as_ref()
                .map(|velocity| between(velocity, n)),
            torque: between(&recording.torque, n),
            temperature: recording
                .temperature
                .as_ref()
                .map(|temperature| between(temperature, 1)),
            trajectory: origin
                .iter()
                .map(|row| recording.trajectory[*row])
                .collect(),
            held_out: origin.iter().map(|row| recording.held_out[*row]).collect(),
            from_current: recording.from_current,
        };
        Self {
            recording: whole,
            origin,
        }
    }
}

/// A sentence where rows are made up.
pub(super) fn remark(made_up: usize) -> Option<String> {
    (made_up > 0).then(|| {
        format!(
            "bridged between their neighbours: {} of the clock without a row",
            counted(made_up, "step")
        )
    })
}

/// Recorded rows with their weights of a row that is so far from one to the next: of the cubic through two on either side, since a straight
/// line has a jump of speed at its ends; of the straight line where a stretch begins or ends there.
fn weights(recording: &TorqueRecording, row: usize, share: f64, steps: f64) -> Vec<(usize, f64)> {
    if share == 0.0 {
        return vec![(row, 1.0)];
    }
    let trajectory = &recording.trajectory;
    let goes_on =
        row >= 1 && row + 2 < trajectory.len() && trajectory[row - 1] == trajectory[row + 2];
    let nodes: Vec<(usize, f64)> = if goes_on {
        vec![
            (row - 1, -1.0),
            (row, 0.0),
            (row + 1, steps),
            (row + 2, steps + 1.0),
        ]
    } else {
        vec![(row, 0.0), (row + 1, steps)]
    };
    let at = share * steps;
    let weight = |value: f64| -> f64 {
        nodes
            .iter()
            .filter(|(_, other)| *other != value)
            .map(|(_, other)| (at - other) / (value - other))
            .product()
    };
    nodes
        .iter()
        .map(|(row, value)| (*row, weight(*value)))
        .collect()
}

/// Rows after which some are lost, and how many.
fn lost(recording: &TorqueRecording, usual: f64) -> Vec<(usize, usize)> {
    let time = &recording.time;
    let after = |row: usize| {
        let (first, last) = (
            row.saturating_sub(AROUND),
            (row + 1 + AROUND).min(time.len() - 1),
        );
        if recording.trajectory[first] != recording.trajectory[last] {
            return None;
        }
        let here = ((time[row + 1] - time[row]) / usual).round() - 1.0;
        let around = ((time[last] - time[first]) / usual).round() - (last - first) as f64;
        let count = here.min(around);
        (count >= 1.0 && count <= LIMIT as f64).then_some((row, count as usize))
    };
    (0..time.len().saturating_sub(1))
        .filter_map(after)
        .collect()
}
