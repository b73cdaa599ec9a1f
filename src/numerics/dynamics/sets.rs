//! Sets of causes by the table of causes: the best one from a start, with what would stand in place of its masses; what of one is faint.

use super::cause::TORQUE_CONSTANT;
use super::cells::{TorqueComponent, TorqueTable, forms};
use super::choice::CauseChoice;
use super::naming::JudgedSet;
use crate::criteria::torque::APART;
use crate::diagnose::table::ComponentSearch;
use crate::effect::Place;

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
