//! Rows that say something of their own: which of them a search looks at, and how many count as one.

use crate::criteria::noise::{ALONE, SEARCHED, STRETCHES};
use crate::diagnose::whitened::WhitenedProblem;
use crate::estimate::{Model, autocorrelation_time};
use crate::robot::Measurements;

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
        autocorrelation_time(problem.of_readings(), width)
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
        .is_some_and(|width| autocorrelation_time(problem.of_readings(), width) > *ALONE)
}
