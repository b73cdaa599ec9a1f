//! A strong finding of a shape that is a little off leaves a torque that a weaker one then explains: before the weaker one is believed, the
//! strong one is fitted anew without it, in every shape that its name has.

use super::choice::{CLEAR, CauseChoice};
use super::problem::TorqueProblem;
use super::refine::refine_one;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;

/// Share of the strong one's gain: what gains more is a cause of its own.
const WEAKER: f64 = 0.35;
/// Rounds, at most.
const ROUNDS: usize = 6;

/// Takes out of a set what the others explain as well once they are shaped without it; tells whether anything was.
pub(super) fn rejudge(problem: &mut TorqueProblem, weighted: &mut WeightedColumns, set: &mut Vec<usize>, seed: u64) -> bool {
    let mut changed = false;
    let mut tried: Vec<(usize, usize)> = Vec::new();
    for _ in 0..ROUNDS {
        let Some((weak, strong)) = next_pair(&CauseChoice::new(problem, weighted, seed), set, &tried) else { break };
        tried.push((weak, strong));
        let without = reshaped(problem, weighted, set, weak, strong, seed);
        let choice = CauseChoice::new(problem, weighted, seed);
        // What may as well be nothing is not named.
        if choice.criterion(&without) <= choice.criterion(set) + CLEAR {
            *set = without;
            changed = true;
        }
    }
    changed
}

/// The weakest form beside a stronger one of its joint that has shapes; pairs that were tried are left out.
fn next_pair(choice: &CauseChoice, set: &[usize], tried: &[(usize, usize)]) -> Option<(usize, usize)> {
    let sweep = choice.base.with(set);
    let solution = sweep.solution();
    let gain: Vec<f64> = set.iter().map(|number| sweep.loss(*number, &solution).square).collect();
    let mut best: Option<(f64, usize, usize)> = None;
    for (weak, strong) in (0..set.len()).flat_map(|weak| (0..set.len()).map(move |strong| (weak, strong))) {
        let [one, other] = [set[weak], set[strong]].map(|number| choice.form(number));
        let rest: Vec<usize> = set.iter().copied().filter(|number| *number != set[weak]).collect();
        let is_pair = weak != strong
            && gain[weak] < WEAKER * gain[strong]
            && one.place == other.place
            && has_shapes(choice, set[strong])
            && choice.is_whole(&rest)
            && !tried.contains(&(set[weak], set[strong]));
        if is_pair && best.is_none_or(|(known, _, _)| gain[weak] < known) {
            best = Some((gain[weak], set[weak], set[strong]));
        }
    }
    best.map(|(_, weak, strong)| (weak, strong))
}

/// Whether there are several forms of a name at a place, or numbers in them.
fn has_shapes(choice: &CauseChoice, number: usize) -> bool {
    let form = choice.form(number);
    let others = || (0..choice.open).any(|other| other != number && is_another_shape(choice, other, number));
    !form.cause.spans(form).is_empty() || others()
}

/// Whether one form may stand for another as the same finding.
fn is_another_shape(choice: &CauseChoice, other: usize, number: usize) -> bool {
    let [form, known] = [other, number].map(|number| choice.form(number));
    form.is_called_as(known) && !form.cause.about().may_repeat
}

/// A set without the weak form, its strong one in the best of all its shapes.
fn reshaped(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &[usize],
    weak: usize,
    strong: usize,
    seed: u64,
) -> Vec<usize> {
    let mut without: Vec<usize> = set.iter().copied().filter(|number| *number != weak).collect();
    let Some(place) = without.iter().position(|number| *number == strong) else { return set.to_vec() };
    let shapes: Vec<usize> = {
        let choice = CauseChoice::new(problem, weighted, seed);
        let rest: Vec<usize> = without.iter().copied().filter(|number| *number != strong).collect();
        let sweep = choice.base.with(&rest);
        let worth = |number: &usize| choice.worth(&sweep, *number);
        let mut shapes: Vec<usize> = (0..choice.open).filter(|other| is_another_shape(&choice, *other, strong)).collect();
        shapes.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        // The best listed one may lead to another minimum than the present one.
        shapes.into_iter().take(1).chain([strong]).collect()
    };
    let mut best: Option<(f64, Vec<usize>)> = None;
    for shape in shapes {
        without[place] = shape;
        let mut trial = without.clone();
        refine_one(problem, weighted, &mut trial, place);
        let choice = CauseChoice::new(problem, weighted, seed);
        let solution = SweptColumns::base(&problem.all, weighted).with(&trial).solution();
        let criterion = choice.criterion(&trial);
        let is_better = best.as_ref().is_none_or(|(known, _)| criterion < *known);
        if is_better && !choice.is_impossible(trial[place], &solution) {
            best = Some((criterion, trial));
        }
    }
    best.map_or_else(|| set.to_vec(), |(_, trial)| trial)
}
