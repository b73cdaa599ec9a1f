//! What each cell says given the components of a model.

use super::cause_table::CauseTable;
use super::cell::{CellShape, FreeShape, Over, ShapeGroup, Shapes};
use super::component::{CellColumns, Component, form_keys, shape_keys};
use super::evidence::{GroupEvidence, log_sum};
use super::frame::UnitColumns;
use super::state::KnownState;
use crate::criteria::cells::{BENDS, FAR_BELOW, JOINS, PAIR, PAIRS, SEPARATED, UNLIKELY};
use crate::effect::{Form, Variable};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What a cell says given a state, with its likeliest shape.
#[derive(Clone)]
pub(super) struct CellEvidence {
    /// ln of the evidence, all shapes mixed.
    pub(crate) log: f64,
    /// The same of its shapes with further numbers.
    pub(crate) bent: f64,
    /// Group and shape.
    pub(crate) shape: (usize, usize),
    pub(crate) amplitude: f64,
    /// What it explains of the squared residual.
    pub(crate) fit: f64,
    /// The shape with its numbers where they say most, with ln of its evidence and its amplitude.
    pub(crate) refined: Option<Refined>,
}

impl CellEvidence {
    /// With a shape in the place of its likeliest one where the rows say more of it.
    pub(crate) fn improve(&mut self, refined: Refined) {
        if refined.log > self.log {
            self.log = refined.log;
            self.refined = Some(refined);
        }
    }
}

/// A shape with the numbers of which the rows say most.
#[derive(Clone)]
pub(super) struct Refined {
    pub(crate) forms: Vec<Form>,
    /// Where it is none of the listed ones.
    pub(crate) shape: Option<CellShape>,
    /// ln of its evidence.
    pub(crate) log: f64,
    pub(crate) amplitude: f64,
}

/// ln of posterior odds of every cell given a state.
pub(super) struct CellScan {
    /// Minus infinity of cells that are not asked.
    pub(crate) log_odds: Vec<f64>,
    /// Of those that were asked closely.
    pub(crate) closely: BTreeMap<usize, CellEvidence>,
    /// All that were asked, the most promising first.
    pub(crate) order: Vec<usize>,
}

impl CellScan {
    /// The cell of the largest odds among those asked closely.
    pub(crate) fn best(&self) -> Option<usize> {
        self.closely
            .keys()
            .copied()
            .max_by(|a, b| self.log_odds[*a].total_cmp(&self.log_odds[*b]))
    }

    /// With the cells that another scan of the same state asked closely.
    fn join(&mut self, other: CellScan) {
        for (cell, found) in other.closely {
            self.log_odds[cell] = other.log_odds[cell];
            self.closely.insert(cell, found);
        }
    }
}

impl CauseTable<'_, '_> {
    /// The evidence of a cell in all of its shapes given a state of some components.
    pub(crate) fn closely(
        &self,
        cell: usize,
        state: &KnownState,
        components: &[&Component],
    ) -> Option<CellEvidence> {
        self.closely_in(cell, state, components, None)
    }

    /// The same of one of its shapes, where that is given.
    pub(crate) fn closely_in(
        &self,
        cell: usize,
        state: &KnownState,
        components: &[&Component],
        shape: Option<&str>,
    ) -> Option<CellEvidence> {
        let block = self.fine(cell);
        let across = self.across_block(block, state, components);
        let mut all: Vec<(f64, usize, usize, GroupEvidence)> = Vec::new();
        let keys = form_keys(components);
        let is_there = |group: usize| {
            block.groups[group]
                .group
                .forms
                .iter()
                .any(|form| keys.contains(&form.key()))
        };
        let shapes = match shape {
            Some(_) => shape_keys(&block.groups),
            None => Vec::new(),
        };
        let there: Vec<bool> = (0..block.groups.len())
            .map(|group| {
                let is_other = shape.is_some_and(|shape| shapes[group] != shape);
                !keys.is_empty() && is_there(group) || is_other
            })
            .collect();
        state.shapes(block, &across, 0, |group, shape, found| {
            if !there[group] {
                all.push((found.log, group, shape, found));
            }
        });
        // A shape of further numbers only where it is clearly better.
        let price = |group: usize, shape: usize| {
            if block.groups[group].group.shapes[shape].is_bent {
                *BENDS
            } else {
                0.0
            }
        };
        let paid = |one: &&(f64, usize, usize, GroupEvidence)| one.0 - price(one.1, one.2);
        let best = all.iter().max_by(|a, b| paid(a).total_cmp(&paid(b)))?;
        let log = log_sum(&all.iter().map(|one| one.0).collect::<Vec<_>>());
        let bent = log_sum(
            &all.iter()
                .filter(|one| price(one.1, one.2) > 0.0)
                .map(|one| one.0)
                .collect::<Vec<_>>(),
        );
        Some(CellEvidence {
            log,
            bent,
            shape: (best.1, best.2),
            amplitude: best.3.amplitude,
            fit: best.3.fit,
            refined: None,
        })
    }

    /// ln of the prior odds of a cell next to others. One that is there already has no price for another component, nor has another motion of
    /// a place that is known to move with a variable: what moves does not keep to one axis.
    pub(crate) fn log_prior(&self, cell: usize, mut others: impl Iterator<Item = usize>) -> f64 {
        let moves = |cell: usize| match &self.cells[cell].shapes {
            Shapes::Free(free) if matches!(free.over, Over::Curve { .. }) => {
                Some((free.motion.place(), free.variable))
            }
            _ => None,
        };
        let this = moves(cell);
        let is_same = |other: usize| {
            let both = this.zip(moves(other));
            other == cell || both.is_some_and(|(a, b)| a.0 == b.0 && a.1.is_alike(b.1))
        };
        if others.any(is_same) {
            0.0
        } else {
            self.cells[cell].log_prior
        }
    }

    /// The odds of every cell given a state, closely those of the best and of some more.
    pub(crate) fn scan(
        &self,
        state: &KnownState,
        components: &[&Component],
        most: usize,
        also: &[usize],
    ) -> CellScan {
        let all: Vec<usize> = (0..self.cells.len()).collect();
        self.scan_some(&all, state, components, most, also)
    }

    /// Some cells, the most promising first.
    pub(crate) fn promising(
        &self,
        cells: &[usize],
        state: &KnownState,
        components: &[&Component],
    ) -> Vec<usize> {
        let across = self.across_cells(cells, state);
        let (_, order) = self.by_bound(cells, state, components, &across);
        order.into_iter().map(|k| cells[k]).collect()
    }

    /// ln of the largest odds that the coarse columns of cells could have given a state, by their places among these, and these places by that,
    /// the most promising first.
    fn by_bound(
        &self,
        cells: &[usize],
        state: &KnownState,
        components: &[&Component],
        (across, first): &(DMatrix<f64>, Vec<usize>),
    ) -> (Vec<f64>, Vec<usize>) {
        let bound = |k: usize| {
            let there = components.iter().map(|component| component.cell);
            let block = &self.coarse[cells[k]];
            self.log_prior(cells[k], there) + state.bound(block, across, first[k])
        };
        let bounds: Vec<f64> = (0..cells.len()).into_par_iter().map(bound).collect();
        let mut order: Vec<usize> = (0..cells.len()).collect();
        order.sort_by(|a, b| bounds[*b].total_cmp(&bounds[*a]).then(a.cmp(b)));
        (bounds, order)
    }

    /// The same of some cells.
    pub(crate) fn scan_some(
        &self,
        cells: &[usize],
        state: &KnownState,
        components: &[&Component],
        most: usize,
        also: &[usize],
    ) -> CellScan {
        let prior = |cell: usize| {
            let there = components.iter().map(|component| component.cell);
            self.log_prior(cell, there)
        };
        let across = self.across_cells(cells, state);
        let (bounds, promising) = self.by_bound(cells, state, components, &across);
        let (across, first) = across;
        let coarse = |k: usize| {
            let mut logs = Vec::new();
            state.shapes(&self.coarse[cells[k]], &across, first[k], |_, _, found| {
                logs.push(found.log)
            });
            prior(cells[k]) + log_sum(&logs)
        };
        let mut log_odds = vec![f64::NEG_INFINITY; self.cells.len()];
        // In turns, until no other cell could come near the best.
        for some in promising.chunks(2 * most) {
            let best = log_odds.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if bounds[some[0]] < (best - *FAR_BELOW).max(*UNLIKELY) {
                break;
            }
            let found: Vec<(usize, f64)> =
                some.par_iter().map(|k| (cells[*k], coarse(*k))).collect();
            found
                .into_iter()
                .for_each(|(cell, log)| log_odds[cell] = log);
        }
        let mut order: Vec<usize> = (0..self.cells.len())
            .filter(|cell| log_odds[*cell].is_finite())
            .collect();
        order.sort_by(|a, b| log_odds[*b].total_cmp(&log_odds[*a]).then(a.cmp(b)));
        order.truncate(most);
        let also: BTreeSet<usize> = also
            .iter()
            .chain(&self.declared)
            .copied()
            .filter(|cell| !order.contains(cell))
            .collect();
        order.extend(also);
        let closely: BTreeMap<usize, CellEvidence> = order
            .into_par_iter()
            .filter_map(|cell| Some((cell, self.closely(cell, state, components)?)))
            .collect();
        for (cell, found) in &closely {
            log_odds[*cell] = prior(*cell) + found.log;
        }
        let order = promising.into_iter().map(|k| cells[k]).collect();
        let mut scan = CellScan {
            log_odds,
            closely,
            order,
        };
        self.refine(&mut scan, state, components, &prior);
        scan
    }

    /// Some cells that may stand for a component, given a state without it, some closely in any case; of a product also those that may do the
    /// same.
    pub(crate) fn scan_instead(
        &self,
        component: &Component,
        cells: &[usize],
        state: &KnownState,
        others: &[&Component],
        most: usize,
        also: &[usize],
    ) -> CellScan {
        let mut scan = self.scan_some(cells, state, others, most, also);
        let siblings = self.siblings(component);
        if !siblings.is_empty() {
            scan.join(self.scan_some(&siblings, state, others, *SEPARATED, &[]));
        }
        if scan.best().is_some_and(|best| best != component.cell) {
            self.separate(&mut scan, state, others);
        }
        for cell in siblings {
            if let Some(found) = scan.closely.get_mut(&cell)
                && let Some(moved) = self.moved(component, cell, state, others)
            {
                scan.log_odds[cell] += (moved.log - found.log).max(0.0);
                found.improve(moved);
            }
        }
        scan
    }

    /// A component's laws in its shape for the motion of another cell; none where that has other directions.
    fn moved(
        &self,
        component: &Component,
        cell: usize,
        state: &KnownState,
        others: &[&Component],
    ) -> Option<Refined> {
        let Shapes::Free(free) = &self.cells[cell].shapes else {
            return None;
        };
        let product = self.product(component)?;
        if free.variable != product.variable || free.over != product.over {
            return None;
        }
        let moved = |form: &Form| Some(free.term(*form.term()?.law()));
        let forms: Vec<Form> = component.forms.iter().map(moved).collect::<Option<_>>()?;
        let keys = form_keys(others);
        let moved = self.with_forms(component, forms);
        let is_other = moved.values.ncols() != component.values.ncols()
            || moved.forms.iter().any(|form| keys.contains(&form.key()));
        let evidence = (!is_other).then(|| self.of_component(&moved, state, others));
        let (log, amplitude) = evidence.flatten()?;
        Some(Refined {
            forms: moved.forms,
            shape: Some(component.shape.clone()),
            log,
            amplitude,
        })
    }

    /// Those of some products that a state shows, the most probable first.
    pub(crate) fn seen_pairs(
        &self,
        pairs: &[FreeShape],
        state: &KnownState,
        components: &[&Component],
    ) -> Vec<FreeShape> {
        let values = |variable: Variable| self.frame.values(variable);
        let log = |free: &FreeShape| {
            let block = CellColumns::of(free.groups(self.survey, &values, false), self.frame);
            let across = self.across_block(&block, state, components);
            let mut logs = Vec::new();
            state.shapes(&block, &across, 0, |_, _, found| logs.push(found.log));
            log_sum(&logs)
        };
        let left = state.left(components, self.frame);
        let rough = |free: &FreeShape| {
            let groups = free.groups(self.survey, &values, false);
            Some((
                self.frame.roughly(groups.first()?.forms.first()?, &left)?,
                *free,
            ))
        };
        let mut promising: Vec<(f64, FreeShape)> = pairs.par_iter().filter_map(rough).collect();
        promising.sort_by(|a, b| b.0.total_cmp(&a.0));
        promising.truncate(6 * *PAIRS);
        let seen = promising
            .par_iter()
            .map(|(_, free)| (log(free), *free))
            .filter(|(log, _)| log + PAIR.ln() > *JOINS);
        let mut seen: Vec<(f64, FreeShape)> = seen.collect();
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        seen.into_iter()
            .take(*PAIRS)
            .map(|(_, free)| free)
            .collect()
    }

    /// The component that a cell is in a scan.
    pub(crate) fn component(&mut self, cell: usize, found: &CellEvidence) -> Component {
        let found_component = self.as_found(cell, found);
        let Some(refined) = found.refined.clone() else {
            self.next += 1;
            return found_component.with_part(self.next);
        };
        let (forms, amplitude) = (refined.forms, refined.amplitude);
        let new = |variable: &Variable| !self.numbers.contains(variable);
        let variables = forms.iter().flat_map(|form| form.variables()).filter(new);
        self.numbers.extend(variables.collect::<Vec<_>>());
        let mut found_component = Component {
            forms,
            amplitude,
            ..found_component
        };
        if let Some(shape) = refined.shape {
            found_component.group = Arc::new(ShapeGroup {
                forms: found_component.forms.clone(),
                shapes: vec![shape.clone()],
                ..(*found_component.group).clone()
            });
            found_component.shape = shape;
        }
        self.component_of(&found_component, cell)
    }

    /// The same with the numbers of its listed shape.
    pub(crate) fn as_found(&self, cell: usize, found: &CellEvidence) -> Component {
        let block = self.fine(cell);
        let seen = &block.groups[found.shape.0];
        let shape = seen.group.shapes[found.shape.1].clone();
        // Forms that this shape leaves out.
        let mut at = 0;
        let (mut forms, mut counts, mut kept) = (Vec::new(), Vec::new(), Vec::new());
        for (form, count) in seen.group.forms.iter().zip(&seen.counts) {
            let columns = at..at + count;
            at += count;
            if shape.shares[columns.clone()]
                .iter()
                .any(|share| *share > 0.0)
            {
                forms.push(form.clone());
                counts.push(*count);
                kept.extend(columns);
            }
        }
        let values = block.values(self.frame).select_columns(
            kept.iter()
                .map(|k| seen.range.start + k)
                .collect::<Vec<_>>()
                .iter(),
        );
        let square = kept
            .iter()
            .map(|k| block.square[seen.range.start + k])
            .collect();
        let shares = kept.iter().map(|k| shape.shares[*k]).collect();
        let shape = CellShape { shares, ..shape };
        let group = ShapeGroup {
            forms: forms.clone(),
            shapes: vec![shape],
            ..seen.group.clone()
        };
        Component::apart(
            cell,
            forms,
            counts,
            group,
            UnitColumns {
                values: Arc::new(values),
                square,
            },
            found.amplitude,
        )
    }

    /// A component with other forms, before it has a part in the covariance.
    pub(crate) fn with_forms(&self, before: &Component, forms: Vec<Form>) -> Component {
        let (columns, counts) = self.frame.columns(&forms);
        Component {
            forms,
            counts,
            values: columns.values,
            square: Arc::new(columns.square),
            ..before.clone()
        }
    }

    /// A component of given forms, e.g. of the model before.
    pub(crate) fn component_of(&mut self, before: &Component, cell: usize) -> Component {
        self.next += 1;
        Component {
            cell,
            ..self.with_forms(before, before.forms.clone())
        }
        .with_part(self.next)
    }

    /// ln of the evidence of one shape with its weight given a state, and its amplitude.
    pub(crate) fn of_component(
        &self,
        component: &Component,
        state: &KnownState,
        others: &[&Component],
    ) -> Option<(f64, f64)> {
        let block = CellColumns::of_component(component, self.frame);
        let across = self.across_block(&block, state, others);
        let mut found = None;
        state.shapes(&block, &across, 0, |_, _, evidence| {
            found = Some((evidence.log, evidence.amplitude))
        });
        found
    }
}
