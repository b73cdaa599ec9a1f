//! The search for the cells that the rows show: forward, exchange, drop, each by the evidence of a cell given all others.

use super::cause_table::CauseTable;
use super::cell::{CellShape, FreeShape, Over};
use super::component::Component;
use super::evidence::AMPLITUDES;
use super::state::KnownState;
use crate::criteria::cells::{
    ALIKE, BENDS, CLOSELY, COMPONENTS, COUPLED, EXCHANGES, FAR_BELOW, JOINS, LEAVES, LIKELY,
    NEARLY, NU, SECOND_ORDER, SWAPS, TRACE, WAVES,
};
use crate::effect::{Form, Variable, names};
use std::collections::BTreeSet;

impl CauseTable<'_, '_> {
    /// Adds components while they pay.
    pub(crate) fn add(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        while let Some(best) = self.best(&components) {
            components.push(best);
            components = self.with_newest(components);
        }
        components
    }

    /// Drops components that no longer pay.
    pub(crate) fn prune(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        while !components.is_empty() {
            let noise = self.noise(&components);
            let odds =
                (0..components.len()).map(|place| (place, self.odds(&components, place, noise)));
            match odds.min_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((place, odds)) if odds <= *LEAVES => _ = components.remove(place),
                _ => break,
            }
            components = self.anew(components);
        }
        components
    }

    /// The standard deviation of the noise given some components, over what is stated.
    fn noise(&self, components: &[Component]) -> f64 {
        self.state(components, None).kappa
    }

    /// ln of the odds of a component given all others, at a noise.
    fn odds(&self, components: &[Component], i: usize, kappa: f64) -> f64 {
        let state = self.state(&without(components, &[i]), Some(kappa));
        let prior = self.log_prior(components[i].cell, &state.components);
        prior + self.log_evidence(&components[i], &state)
    }

    /// What pays most given some components, if anything does. What is smaller than the second order of what this round has found already waits for the next round, which is around a model that has
    /// that in it.
    fn best(&mut self, components: &[Component]) -> Option<Component> {
        let state = self.state(components, None);
        let numbers: usize = components.iter().map(|one| one.part.ncols()).sum();
        // So many numbers describe rows and explain nothing.
        if components.len() >= *COMPONENTS || 3.0 * numbers as f64 > state.rows.freedom {
            return None;
        }
        let mut scan = self.scan_some(&self.likely, &state, *CLOSELY, &[]);
        // A misjudged noise makes everything seem likely.
        let price = *JOINS * (1.0 + 2.0 * state.kappa.clamp(1.0, 4.0).ln());
        if self.likely.len() < self.cells.len()
            && scan.best().is_none_or(|best| scan.log_odds[best] < price)
        {
            scan = self.scan(&state, *CLOSELY, &[]);
        }
        // What was unlikely before is asked again when the likely ones are used up.
        self.likely = scan.order.iter().copied().take(*LIKELY).collect();
        self.separate(&mut scan, &state);
        let best = scan.best().filter(|best| scan.log_odds[*best] >= price)?;
        let found = &scan.closely[&best];
        let new = components
            .iter()
            .filter(|component| !self.from_before.contains(&self.cells[component.cell].key));
        let moved: f64 = new.map(|component| component.amplitude.powi(2)).sum();
        (found.amplitude >= *SECOND_ORDER * moved).then(|| self.component(best, found))
    }

    /// The newest component and those that do in part what it does.
    fn with_newest(&mut self, components: Vec<Component>) -> Vec<Component> {
        let Some(newest) = components.last() else {
            return components;
        };
        self.parts.know(components.iter(), self.frame);
        let coupled = |i: &usize| self.parts.overlap(&components[*i], newest) > *COUPLED;
        let some: Vec<usize> = (0..components.len()).filter(coupled).collect();
        self.backfit_some(components, &some, 1)
    }

    /// All components anew.
    fn anew(&mut self, components: Vec<Component>) -> Vec<Component> {
        self.backfit(components, 2)
    }

    /// Every component anew given all others: shape and amplitude.
    pub(crate) fn backfit(&mut self, components: Vec<Component>, rounds: usize) -> Vec<Component> {
        let all = (0..components.len()).collect::<Vec<_>>();
        self.backfit_some(components, &all, rounds)
    }

    fn backfit_some(
        &mut self,
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
                components[i].amplitude = alone.1;
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
                    components[i].amplitude = grid.amplitude;
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
                let paid = |(log, _): (f64, f64), shape: &CellShape| {
                    log - if shape.is_bent { *BENDS } else { 0.0 }
                };
                if paid(other, &shape) > paid(alone, &components[i].shape) + *SWAPS {
                    grid.refined = self.refined(components[i].cell, &grid, &state);
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
    pub(crate) fn start(&mut self) -> Vec<Component> {
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

    /// Adds cells while they pay, then takes all anew.
    pub(crate) fn grow(&mut self, components: Vec<Component>) -> Vec<Component> {
        self.likely = (0..self.cells.len()).collect();
        let before = components.len();
        let components = self.add(components);
        if components.len() == before {
            return components;
        }
        let components = self.anew(components);
        self.prune(components)
    }

    /// ln of the evidence of a component's cell, its refined shape among the others.
    pub(crate) fn log_evidence(&self, component: &Component, state: &KnownState) -> f64 {
        let grid = self.closely(component.cell, state);
        let grid = grid.map_or(f64::NEG_INFINITY, |found| found.log);
        self.component_evidence(component, state)
            .map_or(grid, |(log, _)| grid.max(log))
    }

    /// Exchanges components for cells that say more in their place.
    pub(crate) fn swap(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        let key = |components: &[Component]| {
            let mut cells: Vec<usize> = components.iter().map(|component| component.cell).collect();
            cells.sort_unstable();
            cells
        };
        let mut seen = BTreeSet::from([key(&components)]);
        // Cells in whose stead every other was far less probable: after an exchange of what they have nothing in common with they are not asked
        // again.
        let mut firm = BTreeSet::new();
        'rounds: for _ in 0..*EXCHANGES {
            let kappa = self.noise(&components);
            let mut order: Vec<usize> = (0..components.len()).collect();
            let size = |i: &usize| components[*i].amplitude;
            order.sort_by(|a, b| size(a).total_cmp(&size(b)));
            for i in order {
                let cell = components[i].cell;
                if firm.contains(&cell) {
                    continue;
                }
                let state = self.state(&without(&components, &[i]), Some(kappa));
                let alike = self.alike(&components[i], 24);
                let near: Vec<usize> = std::iter::once(cell)
                    .chain(self.near(&components[i]))
                    .chain(self.over_its_variable(&components[i], &state))
                    .collect();
                let scan = self.scan_instead(&components[i], &alike, &state, 5, &near);
                let Some(best) = scan.best() else { continue };
                let prior = self.log_prior(cell, &state.components);
                let stays = prior + self.log_evidence(&components[i], &state);
                if best == cell || scan.log_odds[best] <= stays + *SWAPS {
                    let others = scan.closely.keys().filter(|other| **other != cell);
                    let most = others.map(|other| scan.log_odds[*other]);
                    if most.fold(f64::NEG_INFINITY, f64::max) < stays - *FAR_BELOW {
                        firm.insert(cell);
                    }
                    continue;
                }
                let mut next = state.components;
                next.push(self.component(best, &scan.closely[&best]));
                let next = self.backfit(next, 1);
                if seen.insert(key(&next)) {
                    self.loosen(&mut firm, &next, &components[i]);
                    components = next;
                    continue 'rounds;
                }
            }
            break;
        }
        self.prune(components)
    }

    /// Components that do in part what one does that is gone, or what the newest does, are asked again.
    fn loosen(&self, firm: &mut BTreeSet<usize>, components: &[Component], gone: &Component) {
        let Some((newest, others)) = components.split_last() else {
            return;
        };
        self.parts.know(components.iter().chain([gone]), self.frame);
        for other in others {
            let coupled = |one: &Component| self.parts.overlap(other, one) > *COUPLED;
            if coupled(gone) || coupled(newest) {
                firm.remove(&other.cell);
            }
        }
    }

    /// Components, or those that a search from the ones with a name finds, whichever are the more probable: what was taken up before another
    /// cell was in the table is in the way of it.
    pub(crate) fn or_from_named(&mut self, components: Vec<Component>) -> Vec<Component> {
        let named = self.named(&components);
        if named.len() == components.len() {
            return components;
        }
        let mut others = self.anew(named);
        others = self.grow(others);
        others = self.swap(others);
        others = self.grow(others);
        if self.is_better(&others, &components) {
            others
        } else {
            components
        }
    }

    /// Components with a name.
    pub(super) fn named(&self, components: &[Component]) -> Vec<Component> {
        let is_named = |component: &&Component| self.cells[component.cell].is_named();
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
            prior += component.shape.log_weight - (AMPLITUDES as f64).ln();
        }
        let half = 0.5 * (state.rows.freedom + *NU);
        prior - state.log_determinant() - half * (*NU + state.rows.square).ln()
    }

    /// A component without a name that a few causes of the list replace is those: two waves of a gear look like one curve.
    pub(crate) fn by_several(&mut self, mut components: Vec<Component>) -> Vec<Component> {
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

/// Components without some of them.
pub(super) fn without(components: &[Component], out: &[usize]) -> Vec<Component> {
    (0..components.len())
        .filter(|i| !out.contains(i))
        .map(|i| components[i].clone())
        .collect()
}
