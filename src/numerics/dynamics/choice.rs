//! Sets of forms compared: what a form must gain, which may stand together, which in each other's place.

use super::cause::{COULOMB, TorqueForm, VISCOUS};
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::effect::Place;

/// Share of the largest coefficient of a form (per rad/s, or of its sign) below which one is none.
const NEARLY_ZERO: f64 = 0.2;
/// What a finding must gain beyond its penalty to be named: twice the logarithm of odds of 50 to 1.
pub(super) const CLEAR: f64 = 8.0;

/// The forms of one problem, and what each would gain.
pub(super) struct CauseChoice<'a> {
    pub problem: &'a TorqueProblem<'a>,
    pub weighted: &'a WeightedColumns,
    pub base: SweptColumns<'a>,
    pub seed: u64,
    /// Forms that may be chosen; trial forms of a refinement are none of them.
    pub open: usize,
}

impl<'a> CauseChoice<'a> {
    /// Over all forms of a problem.
    pub fn new(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns, seed: u64) -> Self {
        let base = SweptColumns::base(&problem.all, weighted);
        Self { problem, weighted, base, seed, open: problem.all.listed }
    }

    pub fn form(&self, number: usize) -> &TorqueForm {
        &self.problem.all.forms[number]
    }

    /// What a form of `rank` columns must gain.
    pub fn penalty(&self, number: usize, rank: usize) -> f64 {
        let form = self.form(number);
        form.cause.price(form) + rank as f64 * (self.weighted.rows as f64).ln() + 2.0 * (self.open as f64).ln()
    }

    /// Gain beyond the penalty of a form, given a swept set.
    pub fn worth(&self, sweep: &SweptColumns, number: usize) -> f64 {
        let gain = sweep.gain(number);
        let form = self.form(number);
        let about = form.cause.about();
        if (about.positive || (about.brakes && !self.is_part_of_curve(form, |other| sweep.has(other)))) && !sweep.rises(number) {
            return f64::NEG_INFINITY;
        }
        let worth = gain.square - self.penalty(number, gain.rank.max(1));
        let is_possible =
            || form.cause.is_itself(form, &self.problem.scene) && form.cause.is_possible(form, &sweep.values(number));
        if worth > 0.0 && !is_possible() { f64::NEG_INFINITY } else { worth }
    }

    /// Whether coefficients or shape numbers are such as its cause cannot have.
    pub fn is_impossible(&self, number: usize, solution: &[(usize, f64)]) -> bool {
        let own = self.problem.all.of(number);
        let values = || solution.iter().filter(|(column, _)| own.contains(column)).map(|(_, value)| *value);
        let largest = values().map(f64::abs).fold(0.0, f64::max);
        let form = self.form(number);
        let whole: Vec<f64> = own
            .clone()
            .map(|column| solution.iter().find(|(pivot, _)| *pivot == column).map_or(0.0, |(_, value)| *value))
            .collect();
        if !form.cause.is_itself(form, &self.problem.scene) || !form.cause.is_possible(form, &whole) {
            return true;
        }
        let is_in = |other: usize| solution.iter().any(|(column, _)| self.problem.all.of(other).contains(column));
        let about = form.cause.about();
        let only_positive = about.positive || (about.brakes && !self.is_part_of_curve(form, is_in));
        only_positive && values().any(|value| value <= -NEARLY_ZERO * largest)
    }

    /// Whether a curve of speed without a name is at the place of a form, by which forms are in.
    pub fn is_part_of_curve(&self, form: &TorqueForm, is_in: impl Fn(usize) -> bool) -> bool {
        (0..self.problem.all.forms.len()).any(|other| {
            let curve = self.form(other);
            curve.place == form.place && curve.is_nameless_curve() && is_in(other)
        })
    }

    /// Criterion of a set: whitened squared residual, tolerances stretched, and penalties.
    pub fn criterion(&self, set: &[usize]) -> f64 {
        let mut sweep = self.base.clone();
        let mut penalties = 0.0;
        for number in set {
            let rank = sweep.gain(*number).rank;
            penalties += self.penalty(*number, rank);
            sweep.add(*number);
        }
        sweep.square + penalties
    }

    /// Whether a form may join a set: once a name and place, and what modifies a friction after it.
    pub fn may_join(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let taken = |other: &usize| {
            let other_form = self.form(*other);
            *other == number
                || (form.is_called_as(other_form) && (!form.cause.about().may_repeat || form.with == other_form.with))
        };
        let is_barred = || self.problem.barred.iter().any(|(cause, place)| *cause == form.cause.name() && *place == form.place);
        let is_same_curve = |other: &usize| form.is_one_curve_with(self.form(*other));
        !set.iter().any(taken) && self.has_what_it_modifies(number, set) && !set.iter().any(is_same_curve) && !is_barred()
    }

    /// Whether the frictions that a form modifies are in a set.
    fn has_what_it_modifies(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let has = |name: &&str| {
            set.iter().any(|other| self.form(*other).cause.name() == *name && self.form(*other).place == form.place)
        };
        form.cause.about().modifies.iter().all(has)
    }

    /// Whether all of a set have what they modify.
    pub fn is_whole(&self, set: &[usize]) -> bool {
        set.iter().all(|number| self.has_what_it_modifies(*number, set))
    }

    /// Viscous and Coulomb friction of every joint: hardly an arm is without.
    pub fn common(&self) -> Vec<usize> {
        let common = |number: &usize| [VISCOUS, COULOMB].contains(&self.form(*number).cause.name());
        (0..self.open).filter(common).collect()
    }

    /// Whether two forms may stand in each other's place: on one joint, or both wrong masses, drives or mounting.
    pub fn compete(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.form(a), self.form(b));
        a.place == b.place || (a.cause.about().inertial && b.cause.about().inertial)
    }
}

/// Removes what is not worth its penalty.
pub(super) fn backward(choice: &CauseChoice, set: &mut Vec<usize>) {
    remove_below(choice, set, &|_| 0.0);
}

/// Removes what is hardly worth its penalty: what may as well be nothing is not named.
pub(super) fn clear(choice: &CauseChoice, set: &mut Vec<usize>) {
    remove_below(choice, set, &|_| CLEAR);
}

/// Viscous or Coulomb friction beside the other one where a set has only one of them: hardly a joint is without either, and what is left out
/// would be in the number of the other with no word of it in its uncertainty.
pub(super) fn other_friction(choice: &CauseChoice, set: &[usize]) -> Vec<usize> {
    let is_in = |name: &str, place: Place| {
        set.iter().any(|number| choice.form(*number).cause.name() == name && choice.form(*number).place == place)
    };
    let missing = |number: &usize| {
        let form = choice.form(*number);
        let other = if form.cause.name() == VISCOUS { COULOMB } else { VISCOUS };
        !is_in(form.cause.name(), form.place) && is_in(other, form.place)
    };
    let missing: Vec<usize> = choice.common().into_iter().filter(missing).collect();
    let sweep = choice.base.with(set);
    // Friction that would drive is none.
    missing.into_iter().filter(|number| sweep.values(*number).iter().all(|value| *value > 0.0)).collect()
}

/// Removes the least worthy until each is worth what is asked of it.
fn remove_below(choice: &CauseChoice, set: &mut Vec<usize>, asked: &dyn Fn(usize) -> f64) {
    loop {
        let sweep = choice.base.with(set);
        let solution = sweep.solution();
        if let Some(place) = set.iter().position(|number| choice.is_impossible(*number, &solution)) {
            set.remove(place);
            continue;
        }
        let worth_of = |place: usize| {
            let mut rest = set.clone();
            let number = rest.remove(place);
            let loss = sweep.loss(number, &solution);
            choice.is_whole(&rest).then(|| (place, loss.square - choice.penalty(number, loss.rank.max(1)) - asked(number)))
        };
        let least = (0..set.len()).filter_map(worth_of).min_by(|a, b| a.1.total_cmp(&b.1));
        match least {
            Some((place, worth)) if worth <= 0.0 => _ = set.remove(place),
            _ => break,
        }
    }
}
