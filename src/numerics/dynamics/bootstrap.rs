//! Near the gate: the residual with random signs, a second at a time, shows what the best of all forms gains by chance.

use super::choice::CauseChoice;
use super::regressor::TorqueColumn;
use super::sweep::SweptColumns;
use super::weighted::dot;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Draws.
const DRAWS: usize = 60;
/// s whose rows keep their signs together.
const BLOCK: f64 = 1.0;

/// Whether a worth is above that of the best form in every draw.
pub(super) fn beats_chance(choice: &CauseChoice, set: &[usize], sweep: &SweptColumns, worth: f64) -> bool {
    let mut weighted = choice.weighted.with_measured(choice.weighted.measured.clone());
    weighted.subtract(&sweep.solution());
    let rows = weighted.rows;
    let block = ((BLOCK * choice.problem.reduction.rate) as usize).max(1);
    let blocks = rows.div_ceil(block).max(1);
    // Inner products of each column with the residual of each block.
    let parts: Vec<Vec<f64>> = (0..blocks)
        .map(|number| {
            let of = |course: &[f64], joint: usize| {
                let range = (number * block).min(course.len())..((number + 1) * block).min(course.len());
                dot(&course[range.clone()], &weighted.measured[joint][range])
            };
            let column = |column: &TorqueColumn| {
                column.joints.iter().zip(&column.courses).map(|(joint, course)| of(course, *joint)).sum::<f64>()
            };
            weighted.columns.iter().map(column).collect()
        })
        .collect();
    let allowed: Vec<usize> = (0..choice.open).filter(|number| choice.may_join(*number, set)).collect();
    let mut dice = ChaCha8Rng::seed_from_u64(choice.seed);
    (0..DRAWS).all(|_| {
        let mut right = vec![0.0; weighted.columns.len()];
        for part in &parts {
            let sign = if dice.random::<bool>() { 1.0 } else { -1.0 };
            right.iter_mut().zip(part).for_each(|(sum, value)| *sum += sign * value);
        }
        let right = sweep.swept(right);
        let of = |number: &usize| {
            let rank = choice.problem.all.forms[*number].width;
            sweep.gain_with(*number, &right) - choice.penalty(*number, rank)
        };
        allowed.iter().map(of).fold(f64::NEG_INFINITY, f64::max) < worth
    })
}
