//! Forms of a problem: which may stand together, which in each other's place.

use super::cause::{COULOMB, TorqueForm, UNKNOWN, VISCOUS};
use super::problem::TorqueProblem;
use super::sweep::SweptColumns;
use super::weighted::WeightedColumns;
use crate::effect::Place;

/// The forms of one problem, with the base model that is fitted with all of them.
pub(super) struct CauseChoice<'a> {
    pub(crate) problem: &'a TorqueProblem<'a>,
    pub(crate) weighted: &'a WeightedColumns,
    pub(crate) base: SweptColumns<'a>,
    /// Forms that may be chosen; trial forms of a refinement are none of them.
    pub(crate) open: usize,
}

impl<'a> CauseChoice<'a> {
    /// Over all forms of a problem.
    pub(crate) fn new(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns) -> Self {
        Self {
            problem,
            weighted,
            base: SweptColumns::base(&problem.all, weighted),
            open: problem.all.listed,
        }
    }

    /// Over those with a name: a curve without one would be a push, or several causes at once.
    pub(crate) fn named(problem: &'a TorqueProblem<'a>, weighted: &'a WeightedColumns) -> Self {
        let mut forms = problem.all.forms[..problem.all.listed].iter();
        let open = forms.position(|form| form.cause.name == UNKNOWN);
        Self {
            open: open.unwrap_or(problem.all.listed),
            ..Self::new(problem, weighted)
        }
    }

    pub(crate) fn form(&self, number: usize) -> &TorqueForm {
        &self.problem.all.forms[number]
    }

    /// Whether a form with some coefficients, given the forms of a set, is one that its cause can have.
    pub(crate) fn may_be(
        &self,
        number: usize,
        set: &[usize],
        rises: impl Fn() -> bool,
        values: impl Fn() -> Vec<f64>,
    ) -> bool {
        let form = self.form(number);
        let about = form.cause;
        let only_positive = about.positive || (about.brakes && !self.is_part_of_curve(form, set));
        (!only_positive || rises())
            && (form.cause.is_itself)(form, &self.problem.scene)
            && (form.cause.is_possible)(form, &values())
    }

    /// Whether a curve of speed without a name is at the place of a form, in a set.
    fn is_part_of_curve(&self, form: &TorqueForm, set: &[usize]) -> bool {
        set.iter()
            .map(|other| self.form(*other))
            .any(|curve| curve.place == form.place && curve.is_nameless_curve())
    }

    /// Whether a form may join a set: once a name and place, and what modifies a friction after it.
    pub(crate) fn may_join(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let taken = |other: &usize| {
            let other_form = self.form(*other);
            *other == number
                || (form.is_called_as(other_form)
                    && (!form.cause.may_repeat || form.with == other_form.with))
        };
        let is_barred = || self.problem.barred.iter().any(|one| form.is_of_kind(one));
        let is_same_curve = |other: &usize| form.is_one_curve_with(self.form(*other));
        !set.iter().any(taken)
            && self.has_what_it_modifies(number, set)
            && !set.iter().any(is_same_curve)
            && !is_barred()
    }

    /// Whether the frictions that a form modifies are in a set.
    fn has_what_it_modifies(&self, number: usize, set: &[usize]) -> bool {
        let form = self.form(number);
        let has = |name: &&str| {
            set.iter().any(|other| {
                self.form(*other).cause.name == *name && self.form(*other).place == form.place
            })
        };
        form.cause.modifies.iter().all(has)
    }

    /// Whether all of a set have what they modify.
    pub(crate) fn is_whole(&self, set: &[usize]) -> bool {
        set.iter()
            .all(|number| self.has_what_it_modifies(*number, set))
    }

    /// Viscous and Coulomb friction of every joint: hardly an arm is without.
    pub(crate) fn common(&self) -> Vec<usize> {
        let common = |number: &usize| [VISCOUS, COULOMB].contains(&self.form(*number).cause.name);
        (0..self.open).filter(common).collect()
    }

    /// Whether two forms may stand in each other's place: they change the torque of one joint.
    pub(crate) fn compete(&self, a: usize, b: usize) -> bool {
        let joints = self.problem.joints();
        let [a, b] = [a, b].map(|number| self.form(number).acts_on(joints));
        a.iter().any(|joint| b.contains(joint))
    }

    /// Viscous or Coulomb friction where a set has only the other one: hardly a joint is without either, and the missing one would bias the
    /// other without being in its uncertainty.
    pub(crate) fn other_friction(&self, set: &[usize]) -> Vec<usize> {
        let is_in = |name: &str, place: Place| {
            set.iter().any(|number| {
                self.form(*number).cause.name == name && self.form(*number).place == place
            })
        };
        let missing = |number: &usize| {
            let form = self.form(*number);
            let other = if form.cause.name == VISCOUS {
                COULOMB
            } else {
                VISCOUS
            };
            !is_in(form.cause.name, form.place) && is_in(other, form.place)
        };
        let sweep = self.base.with(set);
        // Friction that would drive is none.
        self.common()
            .into_iter()
            .filter(missing)
            .filter(|number| sweep.rises(*number))
            .collect()
    }
}
