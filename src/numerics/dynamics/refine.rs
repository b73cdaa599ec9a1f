//! Shape numbers of what was found, with the coefficients and the width over which the sign of friction turns, all at once: steps of Gauss and
//! Newton.

use super::cause::TorqueForm;
use super::problem::TorqueProblem;
use super::shape_slopes::{ShapeNumber, ShapeSlopes};
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::criteria::torque::BETTER;

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
