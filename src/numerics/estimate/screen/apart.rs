//! Stretches of a recording whose joints and points are rows apart: plain to see before anything is fitted, and fatal to a fit.
//!
//! A rigid motion brings the nominal robot's points of a stretch onto the measured ones, but for the errors of a nominal robot;
//! where it does so only with the joints of rows further on, and all stretches so paired stand under one base, the two logs have slipped.

use crate::criteria::screen::{NOMINAL, SLIPPED_BETTER, STEP, STRETCH, TOGETHER};
use crate::estimate::gauge::{align_points, kabsch};
use crate::robot::Measurements;
use crate::spatial::Pose;
use crate::statistics::nearest;
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::ops::Range;

/// Most rows that are tried either way.
const FARTHEST: i64 = 64;

/// For every row how many rows further on its joints are, where that is plain; zero elsewhere.
pub(super) fn apart(data: &Measurements, predicted: &[Vector3<f64>]) -> Vec<i64> {
    let mut out = vec![0; predicted.len()];
    for first in (0..predicted.len()).step_by(*STEP) {
        let last = (first + *STRETCH).min(predicted.len());
        let rows = last.saturating_sub(*STRETCH)..last;
        let with = |offset: i64| Some((aligned(data, predicted, rows.clone(), offset)?, offset));
        let Some(((_, unshifted), _)) = with(0).filter(|((_, left), _)| *left > *NOMINAL) else {
            continue;
        };
        let tried = (1..=FARTHEST).flat_map(|k| [k, -k]).filter_map(with);
        if let Some(((motion, left), offset)) = tried.min_by(|a, b| a.0.1.total_cmp(&b.0.1))
            && left < *NOMINAL
            && *SLIPPED_BETTER * left < unshifted
        {
            // Rows beside the slip may fit either way, since their joints stand in both places: those are right.
            let is_nearer = |row: &usize| {
                let pair = data.point(*row).zip(other(predicted, *row, offset));
                pair.is_some_and(|(measured, there)| {
                    let off = |point: &Vector3<f64>| (motion.point(point) - measured).norm();
                    *SLIPPED_BETTER * off(there) < off(&predicted[*row])
                })
            };
            rows.filter(is_nearer).for_each(|row| out[row] = offset);
        }
    }
    under_one_base(data, predicted, &mut out);
    beyond_the_log(&mut out);
    out
}

/// Takes back what a stretch's own base alone made of it: runs of rows whose points the base of all rows, as they are paired now, puts no
/// nearer with the other joints than with their own.
fn under_one_base(data: &Measurements, predicted: &[Vector3<f64>], apart: &mut [i64]) {
    if apart.iter().all(|offset| *offset == 0) {
        return;
    }
    let paired = (0..apart.len())
        .filter_map(|row| Some((*other(predicted, row, apart[row])?, data.point(row)?)));
    let (from, to): (Vec<_>, Vec<_>) = paired.unzip();
    if from.len() < *STRETCH {
        return;
    }
    let base = align_points(&from, &to);
    let off = |row: usize, offset: i64| {
        Some((base.point(other(predicted, row, offset)?) - data.point(row)?).norm())
    };
    let rows: Vec<usize> = (0..apart.len()).collect();
    let claimed: Vec<i64> = apart.to_vec();
    for run in rows
        .chunk_by(|a, b| claimed[*a] == claimed[*b])
        .filter(|run| claimed[run[0]] != 0)
    {
        let middle = |offset: i64| {
            let mut all: Vec<f64> = run.iter().filter_map(|row| off(*row, offset)).collect();
            nearest(&mut all, 0.5)
        };
        let better = middle(claimed[run[0]])
            .zip(middle(0))
            .is_some_and(|(there, here)| *TOGETHER * there < here);
        if !better {
            run.iter().for_each(|row| apart[*row] = 0);
        }
    }
}

/// Where a slip reaches an end of the log, the joints of the rows past it were never logged.
fn beyond_the_log(apart: &mut [i64]) {
    let rows = apart.len();
    for offset in apart
        .iter()
        .copied()
        .filter(|offset| *offset != 0)
        .collect::<BTreeSet<i64>>()
    {
        let lost = offset.unsigned_abs() as usize;
        let (lost_rows, next_rows) = if offset > 0 {
            let edge = rows.saturating_sub(lost);
            (edge..rows, edge.saturating_sub(*STEP)..edge)
        } else {
            let edge = lost.min(rows);
            (0..edge, edge..(edge + *STEP).min(rows))
        };
        if apart[next_rows].contains(&offset) {
            apart[lost_rows].fill(offset);
        }
    }
}

/// The motion that brings the points of some rows, with the joints `offset` rows further on, onto the measured ones, and the rms distance
/// that remains, as a share of the stretch's size; `None` where too few rows have both.
fn aligned(
    data: &Measurements,
    predicted: &[Vector3<f64>],
    rows: Range<usize>,
    offset: i64,
) -> Option<(Pose, f64)> {
    let (from, to): (Vec<_>, Vec<_>) = rows
        .filter_map(|row| Some((*other(predicted, row, offset)?, data.point(row)?)))
        .unzip();
    if 2 * from.len() < *STRETCH {
        return None;
    }
    let all: Vec<usize> = (0..from.len()).collect();
    let motion = kabsch(&from, &to, &all);
    let centre = to.iter().sum::<Vector3<f64>>() / to.len() as f64;
    let size: f64 = to.iter().map(|point| (point - centre).norm_squared()).sum();
    let pairs = from.iter().zip(&to);
    let remaining: f64 = pairs
        .map(|(a, b)| (motion.point(a) - b).norm_squared())
        .sum();
    (size > 0.0).then(|| (motion, (remaining / size).sqrt()))
}

fn other(predicted: &[Vector3<f64>], row: usize, offset: i64) -> Option<&Vector3<f64>> {
    predicted.get(row.checked_add_signed(offset as isize)?)
}
