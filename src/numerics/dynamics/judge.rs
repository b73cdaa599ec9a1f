//! Cross-validation over blocks of the fitted rows: what does not lower the error of rows that it was not fitted to, or only by stretching
//! tolerances, is no finding. Held-out rows choose nothing. Where the rows of a block hardly show a finding, nothing is asked.
//!
//! Sets of causes by the table of causes: the best one from a start, with what would stand in place of its masses; what of one is faint.

use crate::cause::TORQUE_CONSTANT;
use crate::cells::{TorqueComponent, TorqueTable, forms};
use crate::choice::CauseChoice;
use crate::criteria::torque::{APART, BLOCKS, CONFIRMED, NAMED};
use crate::diagnose::table::ComponentSearch;
use crate::effect::Place;
use crate::findings::JudgedSet;
use crate::problem::TorqueProblem;
use crate::sweep::SweptColumns;
use crate::weighted::WeightedColumns;
use std::ops::Range;

/// A block of rows in time, and what is fitted to all others.
struct Fold {
    left_out: Vec<Range<usize>>,
    others: WeightedColumns,
}

impl Fold {
    /// The blocks of the fitted rows. Coefficients are known beforehand by the amplitudes of their causes, so that what the others do not show
    /// of a block is nothing and not anything.
    fn all(problem: &TorqueProblem, set: &[usize], priors: &[(usize, f64)]) -> Vec<Self> {
        let runs = problem.runs(false);
        let rows: usize = runs.iter().map(Range::len).sum();
        let of_set = set.iter().flat_map(|form| problem.all.of(*form));
        let mut chosen: Vec<usize> = (0..problem.all.base).chain(of_set).collect();
        chosen.sort_unstable();
        let fold = |block: usize| {
            let ends = [block, block + 1].map(|block| rows * block / *BLOCKS);
            let others = [between(&runs, 0..ends[0]), between(&runs, ends[1]..rows)].concat();
            let mut others = WeightedColumns::new(
                &problem.all,
                &problem.measured,
                problem.weighing(&others),
                &chosen,
            );
            for (column, precision) in priors {
                others.gram[*column][*column] += precision;
            }
            Self {
                left_out: between(&runs, ends[0]..ends[1]),
                others,
            }
        };
        (0..*BLOCKS).map(fold).collect()
    }

    /// Whitened errors of the rows that are left out, and what tolerances are stretched by.
    fn errors(&self, problem: &TorqueProblem, set: &[usize]) -> (Vec<f64>, f64) {
        let base = SweptColumns::base(&problem.all, &self.others);
        let solution = base.with(set).solution();
        let stretched = solution
            .iter()
            .filter_map(|(column, value)| Some(problem.all.prior.get(*column)? * value * value))
            .sum();
        let weighing = problem.weighing(&self.left_out);
        let errors = weighing.measured(&problem.residual(&solution)).concat();
        (errors, stretched)
    }
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

/// What rows that are left out gain by a form.
#[derive(Clone, Copy, Default)]
struct LeftOutGain {
    square: f64,
    /// What it would be if the form were right.
    expected: f64,
}

/// What rows that are left out gain by each of a set.
fn gains(problem: &TorqueProblem, folds: &[Fold], set: &[usize]) -> Vec<LeftOutGain> {
    let mut all = vec![LeftOutGain::default(); set.len()];
    for fold in folds {
        let (whole, stretched) = fold.errors(problem, set);
        for (place, gain) in all.iter_mut().enumerate() {
            let mut rest = set.to_vec();
            rest.remove(place);
            let (errors, by_rest) = fold.errors(problem, &rest);
            for (without, with) in errors.iter().zip(&whole) {
                gain.square += without * without - with * with;
                gain.expected += (without - with).powi(2);
            }
            gain.square += by_rest - stretched;
            gain.expected += by_rest - stretched;
        }
    }
    all
}

/// Withdraws the worst of a set, whose columns have such 1 / variances beforehand, until all are confirmed.
pub(super) fn judge(
    choice: &CauseChoice,
    mut set: Vec<usize>,
    priors: &[(usize, f64)],
) -> JudgedSet {
    let mut withdrawn = Vec::new();
    let folds = Fold::all(choice.problem, &set, priors);
    loop {
        let gains = gains(choice.problem, &folds, &set);
        let short = |place: &usize| {
            let gain = gains[*place];
            // The gain of a right finding scatters about its own square by twice its root.
            let scatter = *NAMED * 2.0 * gain.expected.max(0.0).sqrt();
            let confirmed = *CONFIRMED * choice.form(set[*place]).width as f64;
            gain.square - (gain.expected - scatter).min(confirmed)
        };
        let needed = |place: &usize| {
            let form = choice.form(set[*place]);
            set.iter().any(|other| choice.form(*other).modifies(form))
        };
        let worst = (0..set.len()).filter(|place| short(place) < 0.0 && !needed(place));
        let Some(worst) = worst.min_by(|a, b| short(a).total_cmp(&short(b))) else {
            break;
        };
        withdrawn.push((set.remove(worst), gains[worst].square));
    }
    JudgedSet {
        set,
        withdrawn,
        ..JudgedSet::default()
    }
}

/// Wrong masses, drives and mountings that would stand in place of those of a set, together.
pub(super) struct OtherInertials {
    forms: Vec<usize>,
    /// By how much ln of the posterior with them is less; not below 0.
    worse: f64,
}

impl OtherInertials {
    /// They share the odds that one of them would have as the rival of a finding.
    pub(crate) fn rivals(
        &self,
        choice: &CauseChoice,
        own: f64,
    ) -> Vec<((&'static str, Place), f64)> {
        let log = own - self.worse - (self.forms.len().max(1) as f64).ln();
        self.forms
            .iter()
            .map(|form| {
                (
                    (choice.form(*form).cause.name, choice.form(*form).place),
                    log,
                )
            })
            .collect()
    }
}

/// The best set from what hardly an arm is without, and what stands in place of its wrong masses or drives. One factor on the whole torque of
/// each joint is asked before masses: where factors explain as much, it is these.
pub(super) fn from_common(choice: &CauseChoice) -> (Vec<usize>, Option<OtherInertials>) {
    let mut table = TorqueTable::new(choice);
    let is_drive = |number: &usize| choice.form(*number).cause.name == TORQUE_CONSTANT;
    let inertial = |set: &[TorqueComponent]| -> Vec<usize> {
        forms(set)
            .into_iter()
            .filter(|number| choice.form(*number).cause.inertial)
            .collect()
    };
    let masses = table.searched(&choice.common());
    let drives: Vec<usize> = (0..choice.open)
        .filter(|number| is_drive(number) && choice.form(*number).shape.is_empty())
        .collect();
    if drives.is_empty() || inertial(&masses).is_empty() {
        return (forms(&masses), None);
    }
    let scaled = table.searched(
        &choice
            .common()
            .into_iter()
            .chain(drives)
            .collect::<Vec<_>>(),
    );
    let worse = table.total(&masses) - table.total(&scaled);
    let most = if inertial(&scaled).iter().all(is_drive) {
        0.5 * *APART
    } else {
        0.0
    };
    let (chosen, other, worse) = if worse <= most {
        (scaled, masses, -worse)
    } else {
        (masses, scaled, worse)
    };
    let chosen = forms(&chosen);
    let others: Vec<usize> = inertial(&other)
        .into_iter()
        .filter(|number| !chosen.contains(number))
        .collect();
    let other = (!others.is_empty()).then_some(OtherInertials {
        forms: others,
        worse: worse.max(0.0),
    });
    (chosen, other)
}

/// The best set from a start.
pub(super) fn search(choice: &CauseChoice, start: &[usize]) -> Vec<usize> {
    forms(&TorqueTable::new(choice).searched(start))
}

/// What of a judged set would not be found under the present noise.
pub(super) fn faint(choice: &CauseChoice, judged: &JudgedSet) -> Vec<usize> {
    let mut table = TorqueTable::new(choice);
    table.kept.clone_from(&judged.silent);
    let components = table.components(&judged.set);
    let clear = table.prune(components);
    let kappa = table.noise(&clear);
    // What others need stays in the set, but not for itself.
    let pays = |place: &usize| table.odds_of(&clear, *place, kappa).log_odds > table.least();
    let clear: Vec<usize> = (0..clear.len())
        .filter(pays)
        .map(|place| clear[place].form)
        .collect();
    let mut faint = judged.set.clone();
    faint.retain(|number| !clear.contains(number) && !judged.silent.contains(number));
    faint
}

/// A set after exchanges, merges and removals.
pub(super) fn settle(choice: &CauseChoice, set: &[usize]) -> Vec<usize> {
    settle_with_priors(choice, set).0
}

/// The same with 1 / variance beforehand of its columns, by the amplitudes that the rows show.
pub(super) fn settle_with_priors(
    choice: &CauseChoice,
    set: &[usize],
) -> (Vec<usize>, Vec<(usize, f64)>) {
    let mut table = TorqueTable::new(choice);
    let components = table.components(set);
    let settled = table.settled(components);
    let state = table.state(&settled, None);
    let seen = state.columns.iter().filter(|(_, root)| *root > 0.0);
    let priors = seen.map(|(column, root)| (*column, root.powi(-2)));
    (forms(&settled), priors.collect())
}
