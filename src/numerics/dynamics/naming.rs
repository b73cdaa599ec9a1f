//! What of a set is named. A number at an end of its search would be better beyond it, friction that drives is none, and what is less than
//! two standard deviations may as well be nothing: such forms leave the set, or stay as parts of a sum without a name.

use super::cause::{FittedNumber, TorqueForm, UNKNOWN, VISCOUS, line_of_power};
use super::choice::CauseChoice;
use super::problem::TorqueProblem;
use super::refine::{polish, push};
use super::scene::largest;
use super::shape_slopes::{ShapeNumber, ShapeSlopes, slope};
use super::sweep::{SweptColumns, value_of};
use super::weighted::WeightedColumns;
use crate::criteria::torque::NAMED;

/// Forms that lose their name one after the other, at most.
const ROUNDS: usize = 40;

/// What explains a recording.
#[derive(Default)]
pub(super) struct JudgedSet {
    pub(crate) set: Vec<usize>,
    /// What of the set is part of the model, but too little to be named.
    pub(crate) silent: Vec<usize>,
    /// What cross-validation did not confirm, with what left-out rows gained by each.
    pub(crate) withdrawn: Vec<(usize, f64)>,
}

/// What becomes of a form.
enum NotNamed {
    /// At a position of the set: it leaves.
    Out(usize),
    /// It stays in the model without a name.
    Silent(usize),
    /// Numbers at an end are what they usually are.
    Within(usize, TorqueForm),
}

/// Takes forms with a number at an end of its search out of a set, and their causes out of the search at their places; tells whether any was.
pub(super) fn take_out_ends(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    set: &mut Vec<usize>,
) -> bool {
    let mut changed = false;
    while let Some(one) = at_end(problem, set) {
        changed = true;
        match one {
            NotNamed::Within(place, form) => set[place] = push(problem, weighted, form),
            NotNamed::Out(place) | NotNamed::Silent(place) => {
                let form = problem.all.forms[set.remove(place)].clone();
                problem.barred.push(form);
            }
        }
    }
    changed
}

/// The first form of a set with a number at an end.
fn at_end(problem: &TorqueProblem, set: &[usize]) -> Option<NotNamed> {
    set.iter().enumerate().find_map(|(place, number)| {
        let form = &problem.all.forms[*number];
        match form.within_ends() {
            None => Some(NotNamed::Out(place)),
            Some(within) => (within.shape != form.shape).then_some(NotNamed::Within(place, within)),
        }
    })
}

/// Takes names off until all that are left are right.
pub(super) fn settle_names(
    problem: &mut TorqueProblem,
    weighted: &mut WeightedColumns,
    judged: &mut JudgedSet,
) {
    for _ in 0..ROUNDS {
        let slopes = ShapeSlopes::of(problem, weighted, &judged.set);
        let next = at_end(problem, &judged.set)
            .or_else(|| next(&CauseChoice::new(problem, weighted), judged, &slopes));
        match next {
            None => return,
            Some(NotNamed::Silent(place)) => {
                judged.silent.push(judged.set[place]);
                continue;
            }
            Some(NotNamed::Out(place)) => _ = judged.set.remove(place),
            Some(NotNamed::Within(place, form)) => {
                judged.set[place] = push(problem, weighted, form)
            }
        }
        polish(problem, weighted, &mut judged.set);
    }
}

/// The form with the least right to its name.
fn next(choice: &CauseChoice, judged: &JudgedSet, slopes: &ShapeSlopes) -> Option<NotNamed> {
    let set = &judged.set;
    let sweep = choice.base.with(set);
    let solution = sweep.solution();
    let uncertain = slopes.with_slopes(&sweep);
    let named = |place: &usize| {
        let form = choice.form(set[*place]);
        form.cause.name != UNKNOWN
            && !judged
                .silent
                .iter()
                .any(|silent| choice.form(*silent).is_called_as(form))
    };
    // The largest of its numbers in standard deviations, with its sign.
    let sure = |place: usize| {
        let numbers = fitted(choice, set, set[place], &solution, (&uncertain, slopes));
        let over = numbers
            .iter()
            .map(|number| number.value / number.sigma.max(f64::MIN_POSITIVE));
        over.max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap_or(0.0)
    };
    let wrong = |place: usize, sure: f64| choice.form(set[place]).cause.brakes && sure <= 0.0;
    let weak = (0..set.len())
        .filter(named)
        .map(|place| (place, sure(place)));
    let weak = weak.filter(|(place, sure)| sure.abs() < *NAMED || wrong(*place, *sure));
    let (place, sure) = weak.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let form = choice.form(set[place]);
    // Numbers of many waves are uncertain one by one where few of them are not.
    if let Some(plainer) = choice
        .plainer(form)
        .filter(|_| sweep.loss(set[place], &solution).square > NAMED.powi(2) * form.width as f64)
    {
        return Some(NotNamed::Within(place, plainer.clone()));
    }
    let mut leaning = (0..set.len()).filter(|other| choice.form(set[*other]).modifies(form));
    let is_summed = choice.is_part_of_curve(form, set);
    if is_summed || (form.cause.brakes && sure > 0.0) {
        return Some(NotNamed::Silent(place));
    }
    // What leans on friction that is none is none either.
    Some(NotNamed::Out(leaning.next().unwrap_or(place)))
}

/// Coefficients of a form with their standard deviations; of viscous and Coulomb friction where speed enters by another power than the first,
/// the number of the straight line of both together.
pub(super) fn fitted(
    choice: &CauseChoice,
    set: &[usize],
    number: usize,
    solution: &[(usize, f64)],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> Vec<FittedNumber> {
    if let Some(line) = number_of_line(choice, set, number, solution, (uncertain, slopes)) {
        return vec![line];
    }
    let columns: Vec<usize> = choice.problem.all.of(number).collect();
    let covariance = uncertain.covariance(&columns);
    let of = |(place, column): (usize, &usize)| FittedNumber {
        value: value_of(solution, *column),
        sigma: covariance[place * (columns.len() + 1)].max(0.0).sqrt(),
    };
    columns.iter().enumerate().map(of).collect()
}

/// The number of viscous or Coulomb friction in a set that is of the line; none where speed enters by its first power.
fn number_of_line(
    choice: &CauseChoice,
    set: &[usize],
    number: usize,
    solution: &[(usize, f64)],
    (uncertain, slopes): (&SweptColumns, &ShapeSlopes),
) -> Option<FittedNumber> {
    let (all, form) = (&choice.problem.all, choice.form(number));
    if !form.cause.brakes {
        return None;
    }
    let is_power = |own: &TorqueForm| {
        own.place == form.place && own.cause.name == VISCOUS && !own.shape_numbers().is_empty()
    };
    let power = *set.iter().find(|own| is_power(choice.form(**own)))?;
    let exponent = choice.form(power).shape[0];
    let fastest = largest(&choice.problem.scene.velocity[form.joint()]);
    let (column, is_viscous) = (all.of(power).start, form.cause.name == VISCOUS);
    let of = |exponent: f64| line_of_power(exponent, fastest)[usize::from(is_viscous)];
    let mut along = vec![(column, of(exponent))];
    if !is_viscous {
        along.push((all.of(number).start, 1.0));
    }
    let shape = slopes
        .0
        .iter()
        .find(|(known, _)| *known == ShapeNumber::Of(power, 0));
    let line = along
        .iter()
        .map(|(column, share)| share * value_of(solution, *column))
        .sum();
    along.extend(shape.map(|(_, own)| (*own, value_of(solution, column) * slope(exponent, of))));
    let columns: Vec<usize> = along.iter().map(|(column, _)| *column).collect();
    let covariance = uncertain.covariance(&columns);
    let pairs = (0..along.len()).flat_map(|a| (0..along.len()).map(move |b| (a, b)));
    let variance: f64 = pairs
        .map(|(a, b)| along[a].1 * along[b].1 * covariance[a * along.len() + b])
        .sum();
    Some(FittedNumber {
        value: line,
        sigma: variance.max(0.0).sqrt(),
    })
}
