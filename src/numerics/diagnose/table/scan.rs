//! What each cell says given the components of a model.

use super::cause_table::CauseTable;
use super::cell::{CellShape, FreeShape, ShapeGroup};
use super::component::{CellColumns, Component, shape_keys};
use super::frame::MultipliedColumns;
use super::state::KnownState;
use crate::criteria::cells::{BENDS, FAR_BELOW, JOINS, PAIR, PAIRS, SEPARATED, UNLIKELY};
use crate::effect::Form;
use calib_engine::{GroupEvidence, log_sum};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;

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
    /// ln of the evidence of that shape over that at this amplitude alone.
    pub(crate) spread: f64,
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
    /// ln of its evidence over that at its amplitude alone.
    pub(crate) spread: f64,
}

/// ln of posterior odds of every cell given a state.
#[derive(Default)]
pub(crate) struct CellScan {
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
        let odds = |cell: &usize| self.log_odds[*cell];
        let cells = self.closely.keys().copied();
        cells.max_by(|a, b| odds(a).total_cmp(&odds(b)))
    }

    /// Cells that were asked closely of at least some odds, the likeliest first.
    pub(crate) fn likeliest(&self, least: f64) -> Vec<(usize, &CellEvidence)> {
        let found = self.closely.iter().map(|(cell, found)| (*cell, found));
        let mut found: Vec<_> = found
            .filter(|(cell, _)| self.log_odds[*cell] >= least)
            .collect();
        found.sort_by(|a, b| self.log_odds[b.0].total_cmp(&self.log_odds[a.0]));
        found
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
    /// The evidence of a cell in all of its shapes given a state.
    pub(crate) fn closely(&self, cell: usize, state: &KnownState) -> Option<CellEvidence> {
        self.closely_in(cell, state, None)
    }

    /// The same of one of its shapes, where that is given.
    pub(crate) fn closely_in(
        &self,
        cell: usize,
        state: &KnownState,
        asked: Option<&str>,
    ) -> Option<CellEvidence> {
        let block = self.fine(cell);
        let shapes = asked.map_or_else(Vec::new, |_| shape_keys(&block.groups));
        let is_asked = |group: usize| {
            !state.has_any(&block.groups[group].group.forms)
                && asked.is_none_or(|asked| shapes[group] == asked)
        };
        let there: Vec<bool> = (0..block.groups.len()).map(is_asked).collect();
        let mut all = self.shapes(block, state);
        all.retain(|(group, ..)| there[*group]);
        // A shape of further numbers only where it is clearly better.
        let is_bent = |group: usize, shape: usize| block.groups[group].group.shapes[shape].is_bent;
        let paid = |(group, shape, found): &(usize, usize, GroupEvidence)| {
            found.log - if is_bent(*group, *shape) { *BENDS } else { 0.0 }
        };
        let best = all.iter().max_by(|a, b| paid(a).total_cmp(&paid(b)))?;
        let bent = all.iter().filter(|one| is_bent(one.0, one.1));
        Some(CellEvidence {
            log: log_of_all(&all),
            bent: log_sum(&bent.map(|one| one.2.log).collect::<Vec<_>>()),
            shape: (best.0, best.1),
            amplitude: best.2.amplitude,
            spread: best.2.spread,
            fit: best.2.fit,
            refined: None,
        })
    }

    /// What each shape of a block says given a state, by its group and its place in that.
    pub(super) fn shapes(
        &self,
        block: &CellColumns,
        state: &KnownState,
    ) -> Vec<(usize, usize, GroupEvidence)> {
        state.shapes(block, &self.across_block(block, state), 0)
    }

    /// ln of the prior odds of a cell next to components. One that is there already has no price for another component, nor has another motion
    /// of a place that is known to move with a variable: what moves does not keep to one axis.
    pub(crate) fn log_prior(&self, cell: usize, components: &[Component]) -> f64 {
        let moves = |cell: usize| {
            let free = self.cells[cell].free().filter(|free| free.is_curve())?;
            Some((free.motion.place(), free.variable))
        };
        let this = moves(cell);
        let is_same = |other: &Component| {
            let both = this.zip(moves(other.cell));
            other.cell == cell || both.is_some_and(|(a, b)| a.0 == b.0 && a.1.is_alike(b.1))
        };
        if components.iter().any(is_same) {
            0.0
        } else {
            self.cells[cell].log_prior
        }
    }

    /// The odds of every cell given a state, closely those of the best and of some more.
    pub(crate) fn scan(&self, state: &KnownState, most: usize, also: &[usize]) -> CellScan {
        let all: Vec<usize> = (0..self.cells.len()).collect();
        self.scan_some(&all, state, most, also)
    }

    /// Some cells, the most promising first.
    pub(crate) fn promising(&self, cells: &[usize], state: &KnownState) -> Vec<usize> {
        let across = self.across_cells(cells, state);
        let (_, order) = self.by_bound(cells, state, &across);
        order.into_iter().map(|k| cells[k]).collect()
    }

    /// ln of the largest odds that the coarse columns of cells could have given a state, by their places among these, and these places by that,
    /// the most promising first.
    fn by_bound(
        &self,
        cells: &[usize],
        state: &KnownState,
        (across, first): &(DMatrix<f64>, Vec<usize>),
    ) -> (Vec<f64>, Vec<usize>) {
        let bound = |k: usize| {
            let block = &self.coarse[cells[k]];
            self.log_prior(cells[k], &state.components) + state.bound(block, across, first[k])
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
        most: usize,
        also: &[usize],
    ) -> CellScan {
        let mut scan = self.ranked(cells, state, most, also);
        self.refine(&mut scan, state, None);
        scan
    }

    /// The same without numbers of shapes that say more.
    fn ranked(&self, cells: &[usize], state: &KnownState, most: usize, also: &[usize]) -> CellScan {
        let prior = |cell: usize| self.log_prior(cell, &state.components);
        let across = self.across_cells(cells, state);
        let (bounds, promising) = self.by_bound(cells, state, &across);
        let (across, first) = across;
        let coarse = |k: usize| {
            let shapes = state.shapes(&self.coarse[cells[k]], &across, first[k]);
            prior(cells[k]) + log_of_all(&shapes)
        };
        let mut log_odds = vec![f64::NEG_INFINITY; self.cells.len()];
        // In turns, until no other cell could come near the best.
        for some in promising.chunks(2 * most) {
            let best = log_odds.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if bounds[some[0]] < (best - *FAR_BELOW).max(*UNLIKELY) {
                break;
            }
            let found = some.par_iter().map(|k| (cells[*k], coarse(*k)));
            for (cell, log) in found.collect::<Vec<_>>() {
                log_odds[cell] = log;
            }
        }
        let mut order: Vec<usize> = (0..self.cells.len()).collect();
        order.retain(|cell| log_odds[*cell].is_finite());
        order.sort_by(|a, b| log_odds[*b].total_cmp(&log_odds[*a]).then(a.cmp(b)));
        order.truncate(most);
        let also = also.iter().chain(&self.declared).copied();
        let also: BTreeSet<usize> = also.filter(|cell| !order.contains(cell)).collect();
        order.extend(also);
        let closely = |cell: usize| Some((cell, self.closely(cell, state)?));
        let closely: BTreeMap<usize, CellEvidence> =
            order.into_par_iter().filter_map(closely).collect();
        for (cell, found) in &closely {
            log_odds[*cell] = prior(*cell) + found.log;
        }
        let order = promising.into_iter().map(|k| cells[k]).collect();
        CellScan {
            log_odds,
            closely,
            order,
        }
    }

    /// Some cells that may stand for a component, given a state without it, some closely in any case; of a product also those that may do the
    /// same.
    pub(crate) fn scan_instead(
        &self,
        component: &Component,
        cells: &[usize],
        state: &KnownState,
        most: usize,
        also: &[usize],
    ) -> CellScan {
        let mut scan = self.ranked(cells, state, most, also);
        // A component has its numbers.
        self.refine(&mut scan, state, Some(component));
        if let Some(found) = scan.closely.get_mut(&component.cell)
            && let Some(own) = self.component_evidence(component, state)
            && own.log > found.log
        {
            scan.log_odds[component.cell] += own.log - found.log;
            found.log = own.log;
        }
        let siblings = self.siblings(component);
        if !siblings.is_empty() {
            scan.join(self.scan_some(&siblings, state, *SEPARATED, &[]));
        }
        if scan.best().is_some_and(|best| best != component.cell) {
            self.separate(&mut scan, state);
        }
        for cell in siblings {
            if let Some(found) = scan.closely.get_mut(&cell)
                && let Some(moved) = self.moved(component, cell, state)
            {
                scan.log_odds[cell] += (moved.log - found.log).max(0.0);
                found.improve(moved);
            }
        }
        scan
    }

    /// A component's laws in its shape for the motion of another cell; none where that has other directions.
    fn moved(&self, component: &Component, cell: usize, state: &KnownState) -> Option<Refined> {
        let free = self.cells[cell].free()?;
        let product = self.product(component)?;
        if free.variable != product.variable || free.over != product.over {
            return None;
        }
        let moved = |form: &Form| Some(free.term(*form.term()?.law()));
        let forms: Vec<Form> = component.forms.iter().map(moved).collect::<Option<_>>()?;
        if state.has_any(&forms) {
            return None;
        }
        let group = ShapeGroup {
            forms: forms.clone(),
            shapes: vec![component.shape.clone()],
            positive: component.positive,
            largest: component.largest,
        };
        let found = self.shape_evidence(group, state, &state.columns(self.frame))?;
        Some(Refined {
            forms,
            shape: Some(component.shape.clone()),
            log: found.log,
            amplitude: found.amplitude,
            spread: found.spread,
        })
    }

    /// Those of some products that a state shows, the most probable first.
    pub(crate) fn seen_pairs(&self, pairs: &[FreeShape], state: &KnownState) -> Vec<FreeShape> {
        let columns = state.columns(self.frame);
        let log = |free: &FreeShape| {
            let block = CellColumns::of(self.groups(free, false), self.frame);
            let across = self.across_once(&block, state, &columns);
            log_of_all(&state.shapes(&block, &across, 0))
        };
        let left = state.left(self.frame);
        let rough = |free: &FreeShape| {
            let groups = self.groups(free, false);
            let form = groups.first()?.forms.first()?;
            Some((self.frame.roughly(form, &left)?, *free))
        };
        let mut promising: Vec<(f64, FreeShape)> = pairs.par_iter().filter_map(rough).collect();
        promising.sort_by(|a, b| b.0.total_cmp(&a.0));
        promising.truncate(6 * *PAIRS);
        let seen = promising.par_iter().map(|(_, free)| (log(free), *free));
        let mut seen: Vec<(f64, FreeShape)> =
            seen.filter(|(log, _)| log + PAIR.ln() > *JOINS).collect();
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        seen.truncate(*PAIRS);
        seen.into_iter().map(|(_, free)| free).collect()
    }

    /// The component that a cell is in a scan.
    pub(crate) fn component(&self, cell: usize, found: &CellEvidence) -> Component {
        let mut component = self.as_found(cell, found);
        let Some(refined) = found.refined.clone() else {
            return self.with_part(component);
        };
        component.amplitude = refined.amplitude;
        component.spread = refined.spread;
        component.forms = refined.forms;
        component.shape = refined.shape.unwrap_or(component.shape);
        self.component_of(&component, cell)
    }

    /// A component with its part in the covariance.
    pub(crate) fn with_part(&self, component: Component) -> Component {
        component.with_part(self.next.fetch_add(1, Ordering::Relaxed))
    }

    /// The shape of a cell with the numbers of its listed shape, alone in its group, less the forms that it leaves out.
    pub(crate) fn shape_found(&self, cell: usize, found: &CellEvidence) -> ShapeGroup {
        let seen = &self.fine(cell).groups[found.shape.0];
        let shape = &seen.group.shapes[found.shape.1];
        let (mut at, mut forms, mut shares) = (0, Vec::new(), Vec::new());
        for (form, count) in seen.group.forms.iter().zip(&seen.counts) {
            let of_form = &shape.shares[at..at + count];
            at += count;
            if of_form.iter().any(|share| *share > 0.0) {
                forms.push(form.clone());
                shares.extend_from_slice(of_form);
            }
        }
        let shape = CellShape {
            shares,
            ..shape.clone()
        };
        ShapeGroup {
            forms,
            shapes: vec![shape],
            positive: seen.group.positive,
            largest: seen.group.largest,
        }
    }

    /// The same as a component; it has no part in the covariance yet.
    pub(super) fn as_found(&self, cell: usize, found: &CellEvidence) -> Component {
        let mut group = self.shape_found(cell, found);
        let (columns, counts) = self.frame.columns(&group.forms);
        Component {
            id: 0,
            cell,
            forms: group.forms,
            counts,
            shape: group.shapes.remove(0),
            positive: group.positive,
            largest: group.largest,
            values: columns.values,
            square: Arc::new(columns.square),
            amplitude: found.amplitude,
            spread: found.spread,
            part: Arc::new(DMatrix::default().into()),
            mix: Arc::default(),
        }
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
    pub(crate) fn component_of(&self, before: &Component, cell: usize) -> Component {
        let forms = before.forms.clone();
        self.with_part(Component {
            cell,
            ..self.with_forms(before, forms)
        })
    }

    /// The evidence of a component's shape with its weight given a state.
    pub(crate) fn component_evidence(
        &self,
        component: &Component,
        state: &KnownState,
    ) -> Option<GroupEvidence> {
        let all = state.components.iter().chain([component]);
        self.parts.know(all, self.frame);
        state.component_evidence(component, &self.parts)
    }

    /// The same of one shape, alone in its group, by the columns of the state; none where its forms have other columns than it has shares: with
    /// other numbers a variable may have so few values that its curve has fewer.
    pub(super) fn shape_evidence(
        &self,
        group: ShapeGroup,
        state: &KnownState,
        columns: &MultipliedColumns,
    ) -> Option<GroupEvidence> {
        let block = CellColumns::of(vec![group], self.frame);
        let shape = &block.groups[0].group.shapes[0];
        if block.count() != shape.shares.len() {
            return None;
        }
        let across = self.across_once(&block, state, columns);
        let (.., found) = state.shapes(&block, &across, 0).pop()?;
        Some(found)
    }
}

/// ln of the evidence of all shapes together.
fn log_of_all(shapes: &[(usize, usize, GroupEvidence)]) -> f64 {
    log_sum(&shapes.iter().map(|one| one.2.log).collect::<Vec<_>>())
}
