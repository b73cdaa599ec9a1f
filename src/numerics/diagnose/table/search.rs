//! The table of causes as a problem of the one search (`calib_engine`): what stands are components, each by its part in the covariance of the
//! rows, so that a scan gives the exact evidence of any other cell given them, and nothing but a chosen one is estimated anew.

use super::cause_table::CauseTable;
use super::cell::{CellShape, FreeShape, Over};
use super::component::Component;
use super::scan::{CellEvidence, CellScan};
use super::state::KnownState;
use crate::criteria::cells::{
    ALIKE, BENDS, CLOSELY, COMPONENTS, COUPLED, JOINS, LEAVES, LIKELY, NEARLY, NU, RIVAL,
    SECOND_ORDER, SWAPS, TRACE, TRIED, WAVES,
};
use crate::effect::{Form, Variable, names};
use calib_engine::{AMPLITUDES, Accepted, Cause, Cell, GroupEvidence, Options, Problem, Scanned};
use std::collections::BTreeMap;
use std::sync::{MutexGuard, PoisonError};

/// Components with the noise that fits them.
#[derive(Clone)]
pub(crate) struct StandingComponents {
    pub(crate) components: Vec<Component>,
    /// Standard deviation of the noise over what is stated.
    kappa: f64,
    /// Those that came or went since sizes and shapes of the others were estimated.
    changed: Vec<Component>,
}

fn options() -> Options {
    Options {
        joins: *JOINS,
        leaves: *LEAVES,
        exchanges: *SWAPS,
        tried: *TRIED,
        exchanged: *COMPONENTS,
        regroups: false,
        most: *COMPONENTS,
        told: *RIVAL,
        ..Options::default()
    }
}

impl Problem for CauseTable<'_, '_> {
    type Key = Component;
    type Fit = StandingComponents;
    type Around = CellScan;

    /// What was unlikely before is asked again when the likely cells are used up.
    fn around(&self, fit: &StandingComponents, before: Option<&CellScan>) -> CellScan {
        self.parts.forget();
        let state = self.state(&fit.components, Some(fit.kappa));
        let numbers: usize = fit.components.iter().map(|one| one.part.ncols()).sum();
        // So many numbers describe rows and explain nothing.
        if self.is_closed || 3.0 * numbers as f64 > state.rows.freedom {
            return CellScan::default();
        }
        let likely = before.map(|before| before.order.iter().copied().take(*LIKELY));
        let likely =
            likely.map(|cells| self.scan_some(&cells.collect::<Vec<_>>(), &state, *CLOSELY, &[]));
        let joins = |scan: &CellScan| {
            scan.best()
                .is_some_and(|best| scan.log_odds[best] >= price(fit.kappa))
        };
        let mut scan = likely
            .filter(joins)
            .unwrap_or_else(|| self.scan(&state, *CLOSELY, &[]));
        self.separate(&mut scan, &state);
        scan
    }

    /// What is smaller than the second order of what this round has found already waits for the next round, which is around a model that has
    /// that in it.
    fn scan(
        &self,
        fit: &StandingComponents,
        around: &CellScan,
        out: Option<usize>,
    ) -> Vec<Scanned<Component>> {
        if let Some(out) = out {
            return self.instead(fit, out);
        }
        let found = around.likeliest(price(fit.kappa));
        let is_new = |one: &&Component| !self.from_before.contains(&self.cells[one.cell].key);
        let new = fit.components.iter().filter(is_new);
        let moved: f64 = new.map(|component| component.amplitude.powi(2)).sum();
        match found.first() {
            Some((_, first)) if first.amplitude >= *SECOND_ORDER * moved => {
                self.scanned(found, around)
            }
            _ => Vec::new(),
        }
    }

    fn fit(
        &self,
        set: &[Accepted<Component>],
        before: Option<&StandingComponents>,
        _least: f64,
    ) -> StandingComponents {
        let components: Vec<Component> = set.iter().map(|one| one.cell.key.clone()).collect();
        let Some(before) = before else {
            let (components, kappa) = self.possible(components.clone(), &components);
            return StandingComponents {
                components,
                kappa,
                changed: Vec::new(),
            };
        };
        let came = without_any(&components, &before.components);
        let went = without_any(&before.components, &components);
        let changed = [&before.changed[..], &came, &went].concat();
        let (components, kappa) = self.possible(components, &changed);
        StandingComponents {
            components,
            kappa,
            changed,
        }
    }

    /// Components that do in part what one does that came or went are estimated anew.
    fn settled(&self, fit: &StandingComponents) -> StandingComponents {
        let some = self.coupled(&fit.components, &fit.changed);
        let components = self.backfit_some(fit.components.clone(), &some, 1);
        let (components, kappa) = self.possible(components, &fit.changed);
        StandingComponents {
            components,
            kappa,
            changed: Vec::new(),
        }
    }

    fn set(&self, fit: &StandingComponents) -> Vec<Accepted<Component>> {
        let accepted = |one: &Component| self.accepted(one.clone());
        fit.components.iter().map(accepted).collect()
    }

    /// A noise of twice the standard deviation makes four rows worth one.
    fn independence(&self, fit: &StandingComponents) -> f64 {
        fit.kappa.powi(-2)
    }

    fn log_evidence(&self, fit: &StandingComponents, independence: f64) -> f64 {
        self.total(&fit.components, 1.0 / independence.sqrt())
    }

    fn odds(&self, fit: &StandingComponents, member: usize, independence: f64) -> Option<f64> {
        let kappa = 1.0 / independence.sqrt();
        let state = self.state(&without(&fit.components, &[member]), Some(kappa));
        let component = &fit.components[member];
        let found = self.component_evidence(component, &state)?;
        Some(self.log_prior(component.cell, &state.components) + found.log)
    }

    /// Two components of one name and place may differ in motion and variable.
    fn is_same(&self, one: &Accepted<Component>, other: &Accepted<Component>) -> bool {
        one.cell.key.cell == other.cell.key.cell
    }
}

/// ln of the odds above which a cell joins: a misjudged noise makes everything seem likely.
fn price(kappa: f64) -> f64 {
    *JOINS * (1.0 + 2.0 * kappa.clamp(1.0, 4.0).ln())
}

impl CauseTable<'_, '_> {
    /// The likeliest components, from some on.
    pub(crate) fn searched(&self, from: Vec<Component>) -> Vec<Component> {
        let from: Vec<_> = from.into_iter().map(|one| self.accepted(one)).collect();
        let found = calib_engine::diagnose(self, &from, &options(), |_| ());
        found.after.components
    }

    fn accepted(&self, component: Component) -> Accepted<Component> {
        let cell = &self.cells[component.cell];
        Accepted {
            cell: Cell {
                cause: Cause::named(cell.name.clone()),
                place: cell.place.to_string(),
                log_prior: cell.log_prior,
                shapes: Vec::new(),
                needs: Vec::new(),
                key: component,
            },
            shape: 0,
            numbers: Vec::new(),
        }
    }

    /// Cells of a scan as components, as many as are tried.
    fn scanned(
        &self,
        found: Vec<(usize, &CellEvidence)>,
        scan: &CellScan,
    ) -> Vec<Scanned<Component>> {
        let scanned = |(cell, found): (usize, &CellEvidence)| Scanned {
            accepted: self.accepted(self.component(cell, found)),
            log_odds: scan.log_odds[cell],
        };
        found.into_iter().take(*TRIED).map(scanned).collect()
    }

    /// Cells that say more than a component in its place.
    fn instead(&self, fit: &StandingComponents, out: usize) -> Vec<Scanned<Component>> {
        let component = &fit.components[out];
        let others = without(&fit.components, &[out]);
        let coupled = self.coupled(&others, std::slice::from_ref(component));
        let neighbours: Vec<u64> = coupled.into_iter().map(|i| others[i].id).collect();
        if self.firm().get(&component.id) == Some(&neighbours) {
            return Vec::new();
        }
        let state = self.state(&others, Some(fit.kappa));
        let alike = self.alike(component, 24);
        let near: Vec<usize> = std::iter::once(component.cell)
            .chain(self.near(component))
            .chain(self.over_its_variable(component, &state))
            .collect();
        let scan = self.scan_instead(component, &alike, &state, 5, &near);
        let prior = self.log_prior(component.cell, &state.components);
        let stays = prior + self.log_evidence(component, &state);
        let mut near = scan.likeliest(stays - *JOINS);
        near.retain(|(cell, _)| *cell != component.cell);
        if near.is_empty() {
            self.firm().insert(component.id, neighbours);
        }
        near.retain(|(cell, _)| scan.log_odds[*cell] > stays + *SWAPS);
        self.scanned(near, &scan)
    }

    /// Components that no other cell comes near to replacing.
    fn firm(&self) -> MutexGuard<'_, BTreeMap<u64, Vec<u64>>> {
        self.firm.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Positions of components that are among others, or do in part what one of these does.
    fn coupled(&self, components: &[Component], others: &[Component]) -> Vec<usize> {
        self.parts.know(components.iter().chain(others), self.frame);
        let is_coupled = |i: &usize| {
            let one = &components[*i];
            let mut others = others.iter();
            others.any(|other| one == other || self.parts.overlap(one, other) > *COUPLED)
        };
        (0..components.len()).filter(is_coupled).collect()
    }

    /// Components, where some changed, without those whose one coefficient would have a size that it cannot have, with the noise that fits
    /// them.
    fn possible(
        &self,
        mut components: Vec<Component>,
        changed: &[Component],
    ) -> (Vec<Component>, f64) {
        loop {
            let kappa = self.noise(&components);
            let cannot_be = |place: &usize| {
                let state = || self.state(&without(&components, &[*place]), Some(kappa));
                components[*place].square.len() == 1
                    && self
                        .component_evidence(&components[*place], &state())
                        .is_none()
            };
            let asked = self.coupled(&components, changed);
            match asked.into_iter().find(cannot_be) {
                Some(place) => _ = components.remove(place),
                None => return (components, kappa),
            }
        }
    }

    /// The standard deviation of the noise given some components, over what is stated.
    fn noise(&self, components: &[Component]) -> f64 {
        self.state(components, None).kappa
    }

    /// Every component anew given all others: shape and amplitude.
    pub(crate) fn backfit(&self, components: Vec<Component>, rounds: usize) -> Vec<Component> {
        let all = (0..components.len()).collect::<Vec<_>>();
        self.backfit_some(components, &all, rounds)
    }

    fn backfit_some(
        &self,
        mut components: Vec<Component>,
        some: &[usize],
        rounds: usize,
    ) -> Vec<Component> {
        for _ in 0..rounds {
            let kappa = self.noise(&components);
            let mut changed = false;
            for i in some.iter().copied() {
                let state = self.state(&without(&components, &[i]), Some(kappa));
                let Some(alone) = self.component_evidence(&components[i], &state) else {
                    continue;
                };
                let before = (components[i].amplitude, components[i].shape.shares.clone());
                (components[i].amplitude, components[i].spread) = (alone.amplitude, alone.spread);
                let Some(mut grid) = self.closely(components[i].cell, &state) else {
                    continue;
                };
                let found = self.shape_found(components[i].cell, &grid);
                let shape = found.shapes[0].clone();
                let same = found.forms == components[i].forms
                    && shape.shares.len() == components[i].shape.shares.len();
                if same {
                    components[i].shape = shape.clone();
                    components[i].positive = found.positive;
                    components[i].largest = found.largest;
                    (components[i].amplitude, components[i].spread) = (grid.amplitude, grid.spread);
                }
                if before != (components[i].amplitude, components[i].shape.shares.clone()) {
                    components[i] = self.with_part(components[i].clone());
                    changed = true;
                }
                if same {
                    continue;
                }
                let columns = state.columns(self.frame);
                let Some(other) = self.shape_evidence(found, &state, &columns) else {
                    continue;
                };
                // A shape of further numbers stays on the terms on which it came.
                let paid = |found: GroupEvidence, shape: &CellShape| {
                    found.log - if shape.is_bent { *BENDS } else { 0.0 }
                };
                if paid(other, &shape) > paid(alone, &components[i].shape) + *SWAPS {
                    grid.refined = self.refined(&components[i], &grid, &state);
                    components[i] = self.component(components[i].cell, &grid);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        components
    }

    /// Where the strongest cell is one of loads, every joint that yields to its own: one link that bends may look better than any one joint, and
    /// worse than all of them. Nothing else.
    pub(crate) fn start(&self) -> Vec<Component> {
        if self.is_closed {
            return Vec::new();
        }
        let state = self.state(&[], None);
        let scan = self.scan(&state, *CLOSELY, &[]);
        let loads = |form: &Form| {
            form.variables()
                .iter()
                .any(|variable| matches!(variable, Variable::Load { .. } | Variable::ArmLoad))
        };
        let by_load = |best: usize| {
            let found = self.shape_found(best, &scan.closely[&best]);
            scan.log_odds[best] > *JOINS && found.forms.iter().any(loads)
        };
        if !scan.best().is_some_and(by_load) {
            return Vec::new();
        }
        let yields: Vec<usize> = (0..self.cells.len())
            .filter(|cell| self.cells[*cell].key.starts_with(names::JOINT_COMPLIANCE))
            .collect();
        let mut components = Vec::new();
        for cell in yields {
            if let Some(mut found) = self.closely(cell, &state) {
                found.shape = (0, 0);
                components.push(self.component(cell, &found));
            }
        }
        self.backfit(components, 2)
    }

    /// ln of the evidence of a component's cell, its refined shape among the others.
    pub(crate) fn log_evidence(&self, component: &Component, state: &KnownState) -> f64 {
        let grid = self.closely(component.cell, state);
        let grid = grid.map_or(f64::NEG_INFINITY, |found| found.log);
        self.component_evidence(component, state)
            .map_or(grid, |found| grid.max(found.log))
    }

    /// Components, or those that a search from the ones with a name finds, whichever are the more probable: what was taken up before another
    /// cell was in the table is in the way of it.
    pub(crate) fn or_from_named(&self, components: Vec<Component>) -> Vec<Component> {
        let named = self.named(&components);
        if named.len() == components.len() {
            return components;
        }
        let others = self.searched(self.backfit(named, 2));
        match self.is_better(&others, &components) {
            true => others,
            false => components,
        }
    }

    /// Components with a name.
    pub(super) fn named(&self, components: &[Component]) -> Vec<Component> {
        let is_named = |component: &&Component| self.name_of(component) != names::UNKNOWN;
        components.iter().filter(is_named).cloned().collect()
    }

    /// Whether some components are more probable than others, at the less noise of both.
    pub(super) fn is_better(&self, some: &[Component], others: &[Component]) -> bool {
        let noise = self.noise(some).min(self.noise(others));
        self.total(some, noise) > self.total(others, noise)
    }

    /// ln of the posterior of a set of components, up to a constant, at a noise.
    fn total(&self, components: &[Component], kappa: f64) -> f64 {
        let state = self.state(components, Some(kappa));
        let mut prior = 0.0;
        for (i, component) in components.iter().enumerate() {
            prior += self.log_prior(component.cell, &components[..i]);
            prior += component.shape.log_weight + component.spread - (AMPLITUDES as f64).ln();
        }
        let (freedom, left) = (self.frame.rows().freedom, state.rows.square);
        // Rows that leave less than the least noise do not make it smaller.
        let of_left = match left > freedom {
            true => 0.5 * (freedom + *NU) * ((left + *NU) / (freedom + *NU)).ln(),
            false => 0.5 * (left - freedom),
        };
        prior - state.log_determinant() - of_left
    }

    /// A component without a name that a few causes of the list replace is those: two waves of a gear look like one curve.
    pub(crate) fn by_several(&self, mut components: Vec<Component>) -> Vec<Component> {
        let unnamed: Vec<u64> = components
            .iter()
            .filter(|component| !self.cells[component.cell].is_named())
            .map(|component| component.id)
            .collect();
        for id in unnamed {
            let Some(at) = components.iter().position(|component| component.id == id) else {
                continue;
            };
            let mut named = self.overlaps(&components[at]);
            named.retain(|(_, cell)| self.cells[*cell].is_named());
            // What several do together is not much more than what each of them does.
            let most = named.iter().take(*WAVES).map(|(share, _)| share);
            if most.sum::<f64>() < 1.0 - *ALIKE {
                continue;
            }
            let mut named: Vec<usize> = named.into_iter().take(40).map(|(_, cell)| cell).collect();
            let near = self.near(&components[at]).into_iter();
            let near = near.filter(|cell| self.cells[*cell].is_named() && !named.contains(cell));
            named.extend(near.collect::<Vec<_>>());
            let kappa = self.noise(&components);
            let before = self.total(&components, kappa);
            let mut next = without(&components, &[at]);
            // Coefficients are always those of all components together: taking all anew changes sizes and shapes, and gains little.
            let near = before - (*NEARLY * (before - self.total(&next, kappa))).max(*JOINS);
            for _ in 0..*WAVES {
                let state = self.state(&next, Some(kappa));
                let scan = self.scan_some(&named, &state, 4, &[]);
                let Some(best) = scan.best().filter(|best| scan.log_odds[*best] > 0.0) else {
                    break;
                };
                next.push(self.component(best, &scan.closely[&best]));
                if self.total(&next, kappa) < near {
                    continue;
                }
                next = self.backfit(next, 1);
                if self.total(&next, kappa) > before {
                    components = next;
                    break;
                }
            }
        }
        components
    }

    /// Motions over a variable that show, whose products are not cells yet.
    pub fn shown(&self, components: &[Component]) -> Vec<FreeShape> {
        let followed = |component: &Component| {
            let term = component.forms.first()?.term()?;
            Some((term.motion(), term.law().times, term.law().first.variable))
        };
        let same = |a: &FreeShape, b: &FreeShape| (a.motion, a.variable) == (b.motion, b.variable);
        let free = |component: &Component| self.cells[component.cell].free();
        // What has become a product still shows by its first variable.
        let products: Vec<&FreeShape> = components
            .iter()
            .filter_map(free)
            .filter(|free| free.is_product())
            .collect();
        let mut out = self.multiplied.clone();
        out.retain(|shown| products.iter().any(|product| same(product, shown)));
        let most = components.iter().map(|component| component.amplitude);
        let most = most.fold(0.0, f64::max);
        for component in components {
            if component.amplitude <= 2.0 * *TRACE * most {
                continue;
            }
            let followed = followed(component);
            let shows = match free(component) {
                Some(free) if free.is_product() => None,
                Some(free) => Some(FreeShape {
                    variable: followed.map_or(free.variable, |(.., variable)| variable),
                    ..*free
                }),
                None => followed.and_then(|(motion, times, variable)| {
                    (times.is_none() && variable.is_single()).then_some(FreeShape {
                        motion,
                        variable,
                        over: Over::Line,
                    })
                }),
            };
            out.extend(shows.filter(|shows| !out.iter().any(|other| same(other, shows))));
        }
        out
    }
}

/// Components that are not among others.
fn without_any(components: &[Component], others: &[Component]) -> Vec<Component> {
    let components = components.iter();
    components
        .filter(|one| !others.contains(one))
        .cloned()
        .collect()
}

/// Components without some of them.
pub(super) fn without(components: &[Component], out: &[usize]) -> Vec<Component> {
    (0..components.len())
        .filter(|i| !out.contains(i))
        .map(|i| components[i].clone())
        .collect()
}
