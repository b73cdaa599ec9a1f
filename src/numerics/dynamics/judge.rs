//! Held-out rows in the end: what does not lower their error, or only by stretching tolerances, is no finding. Evidence is of the fitted rows; a
//! motion that comes later shows what a law is worth beyond them. Where held-out rows hardly show a finding, nothing is asked.

use super::choice::CauseChoice;
use super::naming::JudgedSet;
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::Weighing;
use crate::criteria::torque::{CONFIRMED, NAMED};

/// Whitened errors of held-out rows of a solution, and what tolerances are stretched by.
fn held_out_errors(
    problem: &TorqueProblem,
    weighing: Weighing,
    sweep: &SweptColumns,
) -> (Vec<f64>, f64) {
    let solution = sweep.solution();
    let stretched = solution
        .iter()
        .filter_map(|(column, value)| Some(problem.all.prior.get(*column)? * value * value))
        .sum();
    (
        weighing.measured(&problem.residual(&solution)).concat(),
        stretched,
    )
}

/// What held-out rows gain by a form.
#[derive(Clone, Copy)]
struct HeldOutGain {
    square: f64,
    /// What it must be.
    least: f64,
    /// What it would be if the form were right.
    expected: f64,
}

/// What held-out rows gain by each of a set.
fn gains(choice: &CauseChoice, set: &[usize]) -> Vec<HeldOutGain> {
    let runs = choice.problem.runs(true);
    let weighing = choice.problem.weighing(&runs);
    let (whole, stretched) = held_out_errors(choice.problem, weighing, &choice.base.with(set));
    let without = |place: usize| {
        let rest: Vec<usize> = (0..set.len())
            .filter(|other| *other != place)
            .map(|other| set[other])
            .collect();
        let (errors, rest_stretched) =
            held_out_errors(choice.problem, weighing, &choice.base.with(&rest));
        let pairs = || errors.iter().zip(&whole);
        let gain = pairs()
            .map(|(without, with)| without * without - with * with)
            .sum::<f64>()
            + rest_stretched
            - stretched;
        let expected = pairs()
            .map(|(without, with)| (without - with).powi(2))
            .sum::<f64>()
            + rest_stretched
            - stretched;
        // The gain of a right finding scatters about its own square by twice its root.
        let least = expected - *NAMED * 2.0 * expected.max(0.0).sqrt();
        HeldOutGain {
            square: gain,
            least: least.min(*CONFIRMED * choice.form(set[place]).width as f64),
            expected,
        }
    };
    (0..set.len()).map(without).collect()
}

/// Withdraws the worst until all are confirmed; nothing where no rows are held out.
pub(super) fn judge(choice: &CauseChoice, mut set: Vec<usize>) -> JudgedSet {
    let (mut withdrawn, mut is_refuted) = (Vec::new(), false);
    if choice.problem.runs(true).is_empty() {
        return JudgedSet {
            set,
            ..JudgedSet::default()
        };
    }
    loop {
        let gains = gains(choice, &set);
        let short = |place: &usize| gains[*place].square - gains[*place].least;
        let needed = |place: &usize| {
            let form = choice.form(set[*place]);
            set.iter().any(|other| choice.form(*other).modifies(form))
        };
        let worst = (0..set.len()).filter(|place| short(place) < 0.0 && !needed(place));
        let Some(worst) = worst.min_by(|a, b| short(a).total_cmp(&short(b))) else {
            break;
        };
        let HeldOutGain {
            square, expected, ..
        } = gains[worst];
        withdrawn.push((set.remove(worst), square));
        // A form that explains nothing gains nothing; one that loses more than it was expected to gain is another cause's.
        is_refuted |= square < -expected;
    }
    JudgedSet {
        set,
        withdrawn,
        is_refuted,
        ..JudgedSet::default()
    }
}
