//! Shape numbers of what was found: finer and finer grids about each, then all at once with the coefficients and the width over which the sign of
//! friction turns, by steps of Gauss and Newton: one number after the other stays where two go together.

use super::cause::{ShapeSpan, TorqueForm};
use super::problem::TorqueProblem;
use super::shape_slopes::{ShapeNumber, ShapeSlopes};
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::criteria::torque::{BETTER, UNUSUAL};

/// Half widths of the grids: of the logarithm, or of the number itself.
const HALVES: [f64; 4] = [0.3, 0.1, 0.03, 0.01];
/// Points on either side.
const POINTS: i32 = 3;

/// Replaces forms of a set by better shaped ones; tells whether any was.
pub(super) fn refine(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
) -> bool {
    let before = set.to_vec();
    for place in 0..set.len() {
        refine_one(problem, weighted, set, place);
    }
    before != set
}

/// Replaces one form of a set.
fn refine_one(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
    place: usize,
) {
    let form = &problem.all.forms[set[place]];
    for span in (form.cause.spans)(form) {
        for half in HALVES {
            try_grid(problem, weighted, set, place, span, half);
            // What the coarsest grid leaves as it usually is stays so.
            if span.usual == Some(problem.all.forms[set[place]].shape[span.index]) {
                break;
            }
        }
    }
}

/// One grid about the present number.
fn try_grid(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
    place: usize,
    span: ShapeSpan,
    half: f64,
) {
    let form = problem.all.forms[set[place]].clone();
    let now = form.shape[span.index];
    let mut trials = vec![set[place]];
    let is_usual = span.usual == Some(now);
    for point in (-POINTS..=POINTS).filter(|point| {
        if is_usual {
            point.abs() == POINTS
        } else {
            *point != 0
        }
    }) {
        let step = half * f64::from(point) / f64::from(POINTS);
        let moved = if span.by_ratio {
            now * step.exp()
        } else {
            now + step
        };
        if moved < span.least || moved > span.most {
            continue;
        }
        let mut trial = form.clone();
        trial.shape[span.index] = moved;
        let number = push(problem, weighted, trial);
        trials.push(number);
    }
    let others: Vec<usize> = (0..set.len())
        .filter(|other| *other != place)
        .map(|other| set[other])
        .collect();
    let sweep = SweptColumns::base(&problem.all, weighted).with(&others);
    let gain = |number: usize| sweep.gain(number);
    let best = trials
        .iter()
        .copied()
        .max_by(|a, b| gain(*a).total_cmp(&gain(*b)))
        .unwrap_or(set[place]);
    let asked = if is_usual {
        *UNUSUAL + (weighted.rows as f64).ln()
    } else {
        *BETTER
    };
    if gain(best) > gain(set[place]) + asked {
        set[place] = best;
    }
}

/// Steps, at most.
const STEPS: usize = 3;
/// A number changes by less than this factor in a step.
const FARTHEST: f64 = 1.4;
/// rad/s between which the width lies.
const WIDTHS: [f64; 2] = [5e-4, 0.2];

/// A form as a number of the problem.
pub(super) fn push(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    form: TorqueForm,
) -> usize {
    let number = problem.push(form);
    let runs = problem.runs(false);
    problem
        .all
        .of(number)
        .for_each(|column| weighted.push(&problem.all.columns[column], problem.weighing(&runs)));
    number
}

/// Moves the numbers of a set to where the residual is least.
pub(super) fn polish(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut [usize],
) {
    for _ in 0..STEPS {
        if !step(problem, weighted, set) {
            break;
        }
    }
}

/// One step; whether it was worth it.
fn step(problem: &mut TorqueProblem, weighted: &mut WeightedColumns, set: &mut [usize]) -> bool {
    let before = set.to_vec();
    let slopes = ShapeSlopes::of(problem, weighted, set);
    let (square, solution) = {
        let sweep = SweptColumns::base(&problem.all, weighted).with(set);
        (sweep.square, slopes.with_slopes(&sweep).solution())
    };
    let width = problem.scene.sign_width;
    for (number, column) in &slopes.0 {
        let Some((_, change)) = solution.iter().find(|(pivot, _)| pivot == column) else {
            continue;
        };
        match number {
            ShapeNumber::SignWidth => problem.scene.sign_width = moved(width, *change, WIDTHS),
            ShapeNumber::Of(form, index) => {
                let Some(place) = before.iter().position(|known| known == form) else {
                    continue;
                };
                let form = problem.all.forms[set[place]].clone();
                let Some(span) = form
                    .shape_numbers()
                    .into_iter()
                    .find(|span| span.index == *index)
                else {
                    continue;
                };
                set[place] = problem.push(form.with_shape(
                    *index,
                    moved(form.shape[*index], *change, [span.least, span.most]),
                ));
            }
        }
    }
    problem.renew_signs(set);
    *weighted = problem.weighted_of(set);
    if SweptColumns::base(&problem.all, weighted).with(set).square < square - *BETTER {
        return true;
    }
    set.copy_from_slice(&before);
    problem.scene.sign_width = width;
    problem.renew_signs(set);
    *weighted = problem.weighted_of(set);
    false
}

/// A number after a change, within its ends.
fn moved(value: f64, change: f64, [least, most]: [f64; 2]) -> f64 {
    let ratio = (1.0 + change / value).clamp(1.0 / FARTHEST, FARTHEST);
    (value * ratio).clamp(least, most)
}
