//! Rows that say something of their own: which of them a search looks at, and how many count as one. Along a path each pose is near the one
//! before it, so that what changes with the pose looks like noise that is correlated in time.

use crate::criteria::noise::{ALONE, NEAR, SEARCHED, STRETCHES};
use crate::diagnose::whitened::{AutocorrelatedNoise, WhitenedProblem};
use crate::estimate::{Model, autocorrelation_time};
use crate::robot::Measurements;
use crate::statistics::nearest;

/// Rows that the search looks at: all but those of the recording's first stop, to which nobody knows the way, or [`SEARCHED`] of them by a sequence
/// that keeps no step with any design of the recording; the model is fitted to all.
pub(super) fn thinned(data: &Measurements, rows: &[usize]) -> Vec<usize> {
    let rows: Vec<usize> = rows
        .iter()
        .copied()
        .filter(|row| !data.at_first_stop(*row))
        .collect();
    if rows.len() <= *SEARCHED {
        return rows;
    }
    // Multiples of the golden ratio fill the unit interval evenly (Kuipers and Niederreiter, 1974).
    let share = *SEARCHED as f64 / rows.len() as f64;
    let taken = |i: &usize| (*i as f64 * 0.618_033_988_749_895).fract() < share;
    (0..rows.len()).filter(taken).map(|i| rows[i]).collect()
}

/// How many rows of a moving arm count as one, by what is left; of standing points each is one.
pub(super) fn bounded_autocorrelation_time(problem: &WhitenedProblem) -> f64 {
    let rows = &problem.rows;
    let moving = problem.width().filter(|_| problem.data.in_motion(rows));
    let time = moving.map_or(1.0, |width| {
        autocorrelation_time(problem.measured_residual(), width)
    });
    if time < *ALONE {
        1.0
    } else {
        time.min(rows.len() as f64 / *STRETCHES as f64).max(1.0)
    }
}

/// Rows without those that measured a target again before the arm left the pose: what the model leaves there they share, whatever the noise does.
pub(super) fn first_of_pose(data: &Measurements, rows: &[usize]) -> Vec<usize> {
    let again = |row: usize| {
        let before = (0..data.rank_in_time(row))
            .rev()
            .map(|place| data.at_place(place));
        before
            .take_while(|other| data.near_pose(*other, row))
            .any(|other| data.target(other) == data.target(row))
    };
    rows.iter().copied().filter(|row| !again(*row)).collect()
}

/// Whether what a model leaves of standing points lasts from pose to pose.
pub(super) fn lasts(model: &Model, data: &Measurements, rows: &[usize]) -> bool {
    let rows = first_of_pose(data, rows);
    let problem = WhitenedProblem::new(model, data, rows);
    problem
        .width()
        .is_some_and(|width| autocorrelation_time(problem.measured_residual(), width) > *ALONE)
}

/// How far correlation on a path has been looked into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PathCorrelation {
    /// Nothing looks correlated so far.
    Unasked,
    /// Causes that do not follow time are searched by themselves, against white noise.
    CausesFirst,
    /// Noise and those causes were compared.
    Decided,
}

/// What noise does from row to row, and what becomes of the causes that were found without it.
pub(crate) struct CorrelationChange {
    /// None where it is white.
    pub(crate) noise: Option<AutocorrelatedNoise>,
    /// Whether causes that do not follow time explain more than such noise would.
    pub(crate) keeps_causes: bool,
}

/// Whether neighbours in time are neighbours in pose.
pub(super) fn follow_a_path(data: &Measurements, rows: &[usize]) -> bool {
    let mut measured: Vec<usize> = rows.to_vec();
    measured.sort_by_key(|row| data.rank_in_time(*row));
    let apart = |a: usize, b: usize| {
        data.q(a)
            .iter()
            .zip(data.q(b))
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let mut steps: Vec<f64> = measured
        .windows(2)
        .map(|pair| apart(pair[0], pair[1]))
        .filter(|step| *step > 0.0)
        .collect();
    // Rows half of the recording apart stand for any two.
    let half = measured.len() / 2;
    let mut any: Vec<f64> = measured
        .iter()
        .zip(&measured[half..])
        .map(|(a, b)| apart(*a, *b))
        .collect();
    match (nearest(&mut steps, 0.5), nearest(&mut any, 0.5)) {
        (Some(step), Some(any)) => step < *NEAR * any,
        _ => false,
    }
}
