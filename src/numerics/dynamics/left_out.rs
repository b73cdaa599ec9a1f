//! Rows that are left out, a block in time after the other: an angle, a product of angles or a time follows whatever is slow in a recording,
//! and what has no name is kept only where it predicts rows that it was not fitted to. Held-out rows choose nothing.

use crate::cause::UNKNOWN;
use crate::choice::CauseChoice;
use crate::criteria::torque::{BLOCKS, CONFIRMED, NAMED};
use crate::problem::TorqueProblem;
use crate::weighted::WeightedColumns;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// A column of which less than this share is new adds nothing.
const REDUNDANT: f64 = 1e-9;

/// A block of rows in time, and what is fitted to all others.
struct Fold {
    left_out: Vec<Range<usize>>,
    others: WeightedColumns,
    /// 1 / variance beforehand of each column.
    precision: Vec<f64>,
}

impl Fold {
    /// The blocks of the fitted rows, with 1 / variance beforehand of columns of a set.
    fn all(problem: &TorqueProblem, set: &[usize], priors: &[(usize, f64)]) -> Vec<Self> {
        let all = &problem.all;
        let runs = problem.runs(false);
        let rows: usize = runs.iter().map(Range::len).sum();
        let mut chosen = columns(problem, set);
        chosen.sort_unstable();
        let fold = |block: usize| {
            let [first, last] = [block, block + 1].map(|block| rows * block / *BLOCKS);
            let others = [between(&runs, 0..first), between(&runs, last..rows)].concat();
            let weighing = problem.weighing(&others);
            let others = WeightedColumns::new(all, &problem.measured, weighing, &chosen);
            let prior = |column: usize| all.prior.get(column).copied().unwrap_or(0.0);
            let mut precision: Vec<f64> = (0..all.columns.len()).map(prior).collect();
            for (column, more) in priors {
                precision[*column] += more;
            }
            Self {
                left_out: between(&runs, first..last),
                others,
                precision,
            }
        };
        (0..*BLOCKS).map(fold).collect()
    }

    /// Whitened errors of the rows that are left out; none where the others do not determine the model.
    fn errors(&self, problem: &TorqueProblem, set: &[usize]) -> Option<Vec<f64>> {
        let columns = columns(problem, set);
        let count = columns.len();
        let mut gram = DMatrix::from_fn(count, count, |a, b| {
            self.others.gram[columns[a]][columns[b]]
        });
        for (k, column) in columns.iter().enumerate() {
            gram[(k, k)] += self.precision[*column] + REDUNDANT * gram[(k, k)] + f64::MIN_POSITIVE;
        }
        let right = DVector::from_fn(count, |k, _| self.others.right[columns[k]]);
        let values = gram.cholesky()?.solve(&right);
        let solution: Vec<(usize, f64)> = columns.into_iter().zip(values.iter().copied()).collect();
        let residual = problem.residual(&solution);
        Some(
            problem
                .weighing(&self.left_out)
                .measured(&residual)
                .concat(),
        )
    }
}

/// Columns of the base and of a set.
fn columns(problem: &TorqueProblem, set: &[usize]) -> Vec<usize> {
    let of_set = set.iter().flat_map(|form| problem.all.of(*form));
    (0..problem.all.base).chain(of_set).collect()
}

/// The parts of runs that lie between two rows, counted over all of them.
fn between(runs: &[Range<usize>], rows: Range<usize>) -> Vec<Range<usize>> {
    let (mut passed, mut parts) = (0, Vec::new());
    for run in runs {
        let first = rows.start.clamp(passed, passed + run.len());
        let last = rows.end.clamp(passed, passed + run.len());
        if first < last {
            parts.push(run.start + first - passed..run.start + last - passed);
        }
        passed += run.len();
    }
    parts
}

/// What of a set has no name and does not predict rows that are left out as it would if it were right; the worst goes first, and the others are
/// asked without it. Coefficients have such 1 / variances beforehand.
pub(super) fn unconfirmed(
    choice: &CauseChoice,
    set: &[usize],
    priors: &[(usize, f64)],
) -> Vec<usize> {
    let folds = Fold::all(choice.problem, set, priors);
    let (mut set, mut leave) = (set.to_vec(), Vec::new());
    loop {
        let asked = set.iter().copied();
        let asked = asked.filter(|form| choice.form(*form).cause.name == UNKNOWN);
        let short = asked.map(|form| (form, short(choice, &folds, &set, form)));
        let worst = short.filter(|(_, short)| *short < 0.0);
        let Some((worst, _)) = worst.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return leave;
        };
        set.retain(|form| *form != worst);
        leave.push(worst);
    }
}

/// What rows that are left out gain by a form of a set, less what they would if it were right, whitened squares.
fn short(choice: &CauseChoice, folds: &[Fold], set: &[usize], form: usize) -> f64 {
    let others: Vec<usize> = set.iter().copied().filter(|other| *other != form).collect();
    let (mut gain, mut expected) = (0.0, 0.0);
    for fold in folds {
        let [Some(whole), Some(without)] =
            [set, &others].map(|set| fold.errors(choice.problem, set))
        else {
            continue;
        };
        for (without, with) in without.iter().zip(&whole) {
            gain += without * without - with * with;
            expected += (without - with).powi(2);
        }
    }
    // The gain of a right cause scatters about its own square by twice its root.
    let scatter = *NAMED * 2.0 * expected.sqrt();
    gain - (expected - scatter).min(*CONFIRMED * choice.form(form).width as f64)
}
