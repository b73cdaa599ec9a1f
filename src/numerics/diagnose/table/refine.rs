//! The numbers of a shape (an order, a time, a direction) where the rows say most of it.

use super::cause_table::CauseTable;
use super::cell::{FreeShape, Over, ShapeGroup, Shapes, fields};
use super::component::Component;
use super::scan::{CellEvidence, CellScan, Refined};
use super::state::KnownState;
use crate::criteria::cells::{BENDS, CLOSELY, LEVELS, SEPARATED, STICKS};
use crate::effect::{Basis, Form, Term, Variable};
use calib_engine::GroupEvidence;
use rayon::prelude::*;

/// A shape with other numbers, and its forms.
type Variant<T> = (T, Vec<Form>);

impl CauseTable<'_, '_> {
    /// Gives the best cell, and listed shapes near it, the numbers that say most; none to one that has them.
    pub(crate) fn refine(&self, scan: &mut CellScan, state: &KnownState, but: Option<&Component>) {
        let numbers = followed(state.components.iter().chain(but));
        let but = but.map(|component| component.cell);
        let prior = |cell: usize| self.log_prior(cell, &state.components);
        let most = scan.best().map_or(0.0, |best| scan.log_odds[best]);
        let best = scan.best();
        let open = best.is_some_and(|best| !self.cells[best].is_named());
        let is_near =
            |log_odds: f64| open && log_odds > most - (0.2 * most).max(10.0) && log_odds > -5.0;
        // Of those without a name a few: they are many where a cause is strong.
        let mut nameless: Vec<usize> = scan.closely.keys().copied().collect();
        nameless.retain(|cell| !self.cells[*cell].is_named() && is_near(scan.log_odds[*cell]));
        nameless.sort_by(|a, b| {
            scan.log_odds[*b]
                .total_cmp(&scan.log_odds[*a])
                .then(a.cmp(b))
        });
        nameless.truncate(*SEPARATED);
        // Over a variable of a component with other numbers a cell may be far below the best until it has its own.
        let asked = |cell: &usize| {
            if Some(*cell) == but {
                return false;
            }
            Some(*cell) == best
                || self.declared.contains(cell)
                || nameless.contains(cell)
                || self.cells[*cell].is_named() && is_near(scan.log_odds[*cell])
                || self.is_over_numbers(*cell, &numbers)
        };
        // What is still far below the best after large steps gains nothing by small ones that would matter.
        let least = most - (0.2 * most).max(10.0);
        let closer = |cell: usize| {
            let is_worth = |log: f64| prior(cell) + log > least;
            let refined =
                self.refined_while(cell, &scan.closely[&cell], state, &numbers, &is_worth)?;
            Some((cell, refined))
        };
        let listed: Vec<usize> = scan.closely.keys().copied().filter(asked).collect();
        let refined: Vec<(usize, Refined)> = listed.into_par_iter().filter_map(closer).collect();
        for (cell, closer) in refined {
            let Some(found) = scan.closely.get_mut(&cell) else {
                continue;
            };
            if closer.log > found.log {
                found.log = closer.log;
                scan.log_odds[cell] = prior(cell) + closer.log;
            }
            found.refined = Some(closer);
        }
    }

    /// Gives the best cell of a scan and those near it finer shapes where those say more: a product that of one curve times another, a curve
    /// steps.
    pub(crate) fn separate(&self, scan: &mut CellScan, state: &KnownState) {
        let Some(best) = scan.best() else { return };
        let least = 0.8 * scan.log_odds[best];
        let mut near: Vec<usize> = scan.closely.keys().copied().collect();
        near.retain(|cell| scan.log_odds[*cell] >= least);
        let odds = |cell: &usize| scan.log_odds[*cell];
        near.sort_by(|a, b| odds(b).total_cmp(&odds(a)).then(a.cmp(b)));
        let is_product = |cell: &usize| self.cells[*cell].free().is_some_and(FreeShape::is_product);
        let (mut some, mut curves): (Vec<usize>, Vec<usize>) =
            near.into_iter().partition(is_product);
        some.truncate(*SEPARATED);
        curves.truncate(*CLOSELY);
        some.extend(curves);
        let separate = |cell: usize| {
            let found = &scan.closely[&cell];
            let separated = if is_product(&cell) {
                self.separable(cell, found, state)?
            } else {
                self.stepped(cell, found, state, cell == best)?
            };
            (separated.log > found.log).then_some((cell, separated))
        };
        let separated: Vec<(usize, Refined)> = some.into_par_iter().filter_map(separate).collect();
        for (cell, separated) in separated {
            if let Some(found) = scan.closely.get_mut(&cell) {
                scan.log_odds[cell] += separated.log - found.log;
                found.improve(separated);
            }
        }
    }

    /// The shape of a component's cell with its numbers where the evidence is largest, with ln of that and its amplitude; none where it has no
    /// numbers.
    pub(crate) fn refined(
        &self,
        component: &Component,
        found: &CellEvidence,
        state: &KnownState,
    ) -> Option<Refined> {
        let numbers = followed(state.components.iter().chain([component]));
        self.refined_while(component.cell, found, state, &numbers, &|_| true)
    }

    /// The same given components that follow variables with such numbers; steps become smaller while ln of the evidence is worth it.
    fn refined_while(
        &self,
        cell: usize,
        found: &CellEvidence,
        state: &KnownState,
        numbers: &[Variable],
        is_worth: &dyn Fn(f64) -> bool,
    ) -> Option<Refined> {
        let best = self.shape_found(cell, found);
        // All of these are of one motion: what its directions have in common with the state is computed once.
        let columns = state.columns(self.frame);
        let value = |forms: &[Form]| {
            let group = ShapeGroup {
                forms: forms.to_vec(),
                ..best.clone()
            };
            self.shape_evidence(group, state, &columns)
        };
        // Nothing to climb from is computed before there is somewhere to climb to.
        let start = || value(&best.forms);
        let found_as = |forms, found: GroupEvidence| Refined {
            forms,
            shape: None,
            log: found.log,
            amplitude: found.amplitude,
            spread: found.spread,
        };
        match (&self.cells[cell].shapes, &best.forms[..]) {
            (Shapes::Free(free), _) => {
                let forms_of = |free: &FreeShape| {
                    let groups = self.groups(free, true);
                    forms_of(groups.get(found.shape.0)?, found.shape.1)
                };
                let with_forms = |some: Vec<FreeShape>| {
                    let some = some.into_iter().filter(|free| self.slips(free));
                    some.filter_map(|free| Some((free, forms_of(&free)?)))
                        .filter(|(_, forms)| !state.has_any(forms))
                        .collect::<Vec<_>>()
                };
                // The numbers of components first.
                if has_no_numbers(free, numbers) {
                    return None;
                }
                let (mut first, mut start, mut moved) = (*free, start()?, false);
                let known = numbers.iter().filter(|variable| {
                    free.variable.is_alike(**variable) && **variable != free.variable
                });
                let known = known.map(|variable| FreeShape {
                    variable: *variable,
                    ..*free
                });
                for (other, forms) in with_forms(known.collect()) {
                    if let Some(evidence) = value(&forms).filter(|other| other.log > start.log) {
                        (first, start, moved) = (other, evidence, true);
                    }
                }
                let near = |free: &FreeShape, level| with_forms(free.near(level));
                let rules = Climb {
                    near: &near,
                    value: &value,
                    price: &|_, _| 0.0,
                    is_same: &FreeShape::is_same,
                    is_worth,
                };
                let climbed = rules.from(first, start);
                let (free, evidence) = climbed.or(moved.then_some((first, start)))?;
                Some(found_as(forms_of(&free)?, evidence))
            }
            (Shapes::Listed(_), [form]) if !form.cause().is_nameless() => {
                let near = |form: &Form, level| {
                    let near = form.near(self.survey, level).into_iter();
                    near.map(|near| (near.clone(), vec![near]))
                        .filter(|(_, forms)| !state.has_any(forms))
                        .collect::<Vec<_>>()
                };
                let price = |form: &Form, near: &Form| {
                    if is_whole_order(form) && !is_whole_order(near) {
                        *BENDS
                    } else {
                        0.0
                    }
                };
                let rules = Climb {
                    near: &near,
                    value: &value,
                    price: &price,
                    is_same: &|a, b| a == b,
                    is_worth,
                };
                if (0..*LEVELS).all(|level| near(form, level).is_empty()) {
                    return None;
                }
                let (form, evidence) = rules.from(form.clone(), start()?)?;
                Some(found_as(vec![form], evidence))
            }
            _ => None,
        }
    }

    /// Whether a cell follows a variable with numbers that a component follows with others.
    fn is_over_numbers(&self, cell: usize, numbers: &[Variable]) -> bool {
        self.cells[cell].free().is_some_and(|free| {
            let other = |variable: &Variable| {
                free.variable.is_alike(*variable) && free.variable != *variable
            };
            numbers.iter().any(other)
        })
    }

    /// Whether a shape is none of what sticks over so much of a joint's travel that it is the joint's angle.
    fn slips(&self, free: &FreeShape) -> bool {
        let slips = |variable: Variable| match variable {
            Variable::Stretch { joint, limit } => limit <= *STICKS * self.survey.travel(joint),
            _ => true,
        };
        slips(free.variable) && !matches!(free.over, Over::Product(other) if !slips(other))
    }
}

/// Variables that components follow, each with its numbers.
fn followed<'c>(components: impl Iterator<Item = &'c Component>) -> Vec<Variable> {
    let mut out = Vec::new();
    for variable in components.flat_map(|one| one.forms.iter().flat_map(|form| form.variables())) {
        if !out.contains(&variable) {
            out.push(variable);
        }
    }
    out
}

/// The forms of a shape of a group: those that it gives a share; none where the group has fewer shapes with other numbers.
fn forms_of(group: &ShapeGroup, shape: usize) -> Option<Vec<Form>> {
    let mut at = 0;
    let shares = &group.shapes.get(shape)?.shares;
    let mut out = Vec::new();
    for form in &group.forms {
        let term = form.term();
        let count = term.map_or(0, |term| fields(term.motion()) * term.law().count());
        let shares_here = shares.get(at..at + count).unwrap_or_default();
        at += count;
        if shares_here.is_empty() || shares_here.iter().any(|share| *share > 0.0) {
            out.push(form.clone());
        }
    }
    Some(out)
}

/// How a shape is stepped from to better ones near it.
struct Climb<'c, T> {
    near: &'c dyn Fn(&T, i32) -> Vec<Variant<T>>,
    value: &'c dyn Fn(&[Form]) -> Option<GroupEvidence>,
    /// What a step costs.
    price: &'c dyn Fn(&T, &T) -> f64,
    is_same: &'c dyn Fn(&T, &T) -> bool,
    /// Steps become smaller while ln of the evidence is worth it.
    is_worth: &'c dyn Fn(f64) -> bool,
}

impl<T: Clone> Climb<'_, T> {
    /// Steps to the best near, in steps that halve, until none is better: the last with ln of its evidence and its amplitude, none if that is
    /// the first.
    fn from(&self, first: T, start: GroupEvidence) -> Option<(T, GroupEvidence)> {
        // A step back, or a half step on towards where a whole one led, has been asked before.
        let mut known: Vec<(T, Option<GroupEvidence>)> = vec![(first.clone(), Some(start))];
        let (mut now, mut evidence, mut moved) = (first, start, false);
        for level in 0..*LEVELS {
            if level > 0 && !(self.is_worth)(evidence.log) {
                break;
            }
            loop {
                let mut tried: Vec<(GroupEvidence, T)> = Vec::new();
                for (other, forms) in (self.near)(&now, level) {
                    let asked = known
                        .iter()
                        .find(|(known, _)| (self.is_same)(known, &other));
                    let found = match asked {
                        Some((_, found)) => *found,
                        None => {
                            let found = (self.value)(&forms);
                            known.push((other.clone(), found));
                            found
                        }
                    };
                    tried.extend(found.map(|found| (found, other)));
                }
                let paid =
                    |(found, other): &(GroupEvidence, T)| found.log - (self.price)(&now, other);
                let best = tried.into_iter().max_by(|a, b| paid(a).total_cmp(&paid(b)));
                let Some(next) = best else {
                    break;
                };
                if paid(&next) <= evidence.log + 1e-6 {
                    break;
                }
                let gained = next.0.log - evidence.log;
                (evidence, now, moved) = (next.0, next.1, true);
                if gained < 0.05 {
                    break;
                }
            }
        }
        moved.then_some((now, evidence))
    }
}

/// Whether a motion over a variable has no numbers, nor any of components that it may take.
fn has_no_numbers(free: &FreeShape, numbers: &[Variable]) -> bool {
    let is_alike = |other: &Variable| free.variable.is_alike(*other) && *other != free.variable;
    free.near(0).is_empty() && !numbers.iter().any(is_alike)
}

/// Whether a form is a wave of whole periods a turn.
fn is_whole_order(form: &Form) -> bool {
    matches!(form.term().map(Term::basis), Some(Basis::Wave { .. }))
}
