//! The search for the cells that the rows show: forward, exchange, drop, refine, each by the evidence of a cell beside all others.

use super::cell::{Cell, FreeShape, Shapes};
use super::evidence::{AMPLITUDES, log_sum};
use super::frame::{Frame, product, view};
use super::state::{Block, Component, PartProducts, State};
use super::{generated, listed};
use crate::criteria::cells::{BENDS, CLOSELY, COMPONENTS, JOINS, LEAVES, NU, SECOND_ORDER, SWAPS, TRACE};
use crate::diagnose::types::Question;
use crate::effect::{Basis, Form, Survey, Variable, names};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

/// ln of odds, below the best ones, from which a cell is not asked; and below which none is.
const FAR_BELOW: f64 = 12.0;
const UNLIKELY: f64 = -8.0;
/// Cells that are asked again at once when one has joined.
const LIKELY: usize = 240;

/// The table of cells over the rows of a recording.
pub(super) struct Table<'f, 'a> {
    pub frame: &'f Frame<'a>,
    pub survey: &'f Survey<'f>,
    pub cells: Vec<Cell>,
    pub coarse: Vec<Block>,
    fine: Vec<OnceLock<Block>>,
    /// Products of the columns of each component with those of every coarse block.
    products: BTreeMap<u64, DMatrix<f64>>,
    parts: PartProducts,
    /// The first of all coarse columns of each cell, and their number.
    pub first: Vec<usize>,
    columns: usize,
    next: u64,
    /// Keys of cells that are in the model around which the rows are looked at.
    pub from_before: Vec<String>,
    /// Motions and variables whose products with others are cells.
    multiplied: Vec<FreeShape>,
}

/// What a cell says beside a state, with its likeliest shape.
#[derive(Clone)]
pub(super) struct CellEvidence {
    /// ln of the evidence, all shapes mixed.
    pub log: f64,
    /// The same of its shapes with further numbers.
    pub bent: f64,
    /// Group and shape.
    shape: (usize, usize),
    amplitude: f64,
    /// The shape with its numbers where they say most, with ln of its evidence and its amplitude.
    refined: Option<(Form, f64, f64)>,
}

/// ln of posterior odds of every cell beside a state.
pub(super) struct Scan {
    /// Minus infinity of cells that are not asked.
    pub log_odds: Vec<f64>,
    /// Of those that were asked closely.
    pub closely: BTreeMap<usize, CellEvidence>,
    /// All that were asked, the most promising first.
    order: Vec<usize>,
}

impl Scan {
    /// The cell of the largest odds among those asked closely.
    pub fn best(&self) -> Option<usize> {
        self.closely.keys().copied().max_by(|a, b| self.log_odds[*a].total_cmp(&self.log_odds[*b]))
    }
}

impl<'f, 'a> Table<'f, 'a> {
    /// All cells of a recording.
    pub fn new(
        frame: &'f mut Frame<'a>,
        survey: &'f Survey<'f>,
        question: &Question,
        shown: &[FreeShape],
        keeps: impl Fn(&Cell) -> bool,
    ) -> Self {
        let mut cells = generated::cells(survey, frame, question.open_world);
        cells.extend(generated::products(shown, survey, frame));
        let values = |of: Variable| frame.values(of);
        let mut named = listed::cells(survey, &values, question);
        named.append(&mut cells);
        named.retain(keeps);
        let mut motions = Vec::new();
        let mut variables = Vec::new();
        for form in named.iter().flat_map(|cell| cell.groups(survey, &values, false)).flat_map(|group| group.forms) {
            let Some(term) = form.term() else { continue };
            if !motions.contains(&term.motion()) {
                motions.push(term.motion());
            }
            variables.extend(
                term.law().variables().into_iter().filter(|of| of.is_single() && !variables.contains(of)).collect::<Vec<_>>(),
            );
        }
        frame.prepare(&motions, &variables);
        let frame = &*frame;
        let values = |of: Variable| frame.values(of);
        let coarse: Vec<Block> = named.par_iter().map(|cell| Block::of(cell.groups(survey, &values, false), frame)).collect();
        let fine = named.iter().map(|_| OnceLock::new()).collect();
        let mut columns = 0;
        let mut first = Vec::with_capacity(coarse.len());
        for block in &coarse {
            first.push(columns);
            columns += block.columns.values.ncols();
        }
        let products = BTreeMap::new();
        Self {
            frame,
            survey,
            cells: named,
            coarse,
            fine,
            products,
            parts: PartProducts::default(),
            first,
            columns,
            next: 0,
            from_before: Vec::new(),
            multiplied: shown.to_vec(),
        }
    }

    /// The cell of a key.
    pub fn cell(&self, key: &str) -> Option<usize> {
        self.cells.iter().position(|cell| cell.key == key)
    }

    fn fine(&self, cell: usize) -> &Block {
        if !self.cells[cell].is_coarse() {
            return &self.coarse[cell];
        }
        self.fine[cell].get_or_init(|| {
            let values = |of: Variable| self.frame.values(of);
            Block::of(self.cells[cell].groups(self.survey, &values, true), self.frame)
        })
    }

    /// Computes once what scans need of some components.
    pub fn know(&mut self, components: &[Component]) {
        for own in components {
            if !self.products.contains_key(&own.id) {
                let with = |block: &Block| product(view(&own.part), view(&block.columns.values));
                let all: Vec<DMatrix<f64>> = self.coarse.par_iter().map(with).collect();
                let values: Vec<f64> = all.iter().flat_map(|products| products.iter().copied()).collect();
                self.products.insert(own.id, DMatrix::from_vec(own.part.ncols(), self.columns, values));
            }
        }
        let known: BTreeSet<u64> = components.iter().map(|own| own.id).collect();
        if self.products.len() > 3 * *COMPONENTS {
            self.products.retain(|id, _| known.contains(id));
        }
    }

    /// L^-1 Z'X of all coarse columns beside a state.
    pub fn across(&self, state: &State) -> DMatrix<f64> {
        let all: Vec<usize> = (0..self.cells.len()).collect();
        self.across_cells(&all, state).0
    }

    /// The same of some cells, with the first column of each.
    fn across_cells(&self, cells: &[usize], state: &State) -> (DMatrix<f64>, Vec<usize>) {
        let parts: Vec<&DMatrix<f64>> = state.components.iter().map(|id| &self.products[id]).collect();
        let rows: usize = parts.iter().map(|part| part.nrows()).sum();
        let mut first = Vec::with_capacity(cells.len());
        let mut columns = Vec::new();
        for cell in cells {
            first.push(columns.len());
            let own = self.coarse[*cell].columns.values.ncols();
            columns.extend(self.first[*cell]..self.first[*cell] + own);
        }
        let solved: Vec<DMatrix<f64>> = columns
            .par_chunks(512)
            .map(|some| {
                let mut values = Vec::with_capacity(rows * some.len());
                for column in some {
                    for part in &parts {
                        let count = part.nrows();
                        values.extend_from_slice(&part.as_slice()[column * count..(column + 1) * count]);
                    }
                }
                state.solved(DMatrix::from_vec(rows, some.len(), values))
            })
            .collect();
        let values = solved.iter().flat_map(|part| part.iter().copied()).collect();
        (DMatrix::from_vec(rows, columns.len(), values), first)
    }

    /// Cells that do much of what a component does.
    fn alike(&self, own: &Component, most: usize) -> Vec<usize> {
        const ALIKE: f64 = 0.2;
        // Its likeliest motion, of unit length, in the directions of its part.
        self.parts.know(&[own], self.frame);
        let state = State::of(&[own], &self.parts, self.frame, None);
        let Some(weights) = state.weights() else { return Vec::new() };
        let motion = &*own.part * &weights;
        let length = motion.norm().max(f64::MIN_POSITIVE);
        let Some(products) = self.products.get(&own.id) else { return Vec::new() };
        let along: Vec<f64> = products.tr_mul(&weights).iter().map(|value| value / length).collect();
        let overlap = |cell: usize| {
            let range = self.first[cell]..self.first[cell] + self.coarse[cell].columns.values.ncols();
            (self.coarse[cell].overlap(&along[range]), cell)
        };
        let mut all: Vec<(f64, usize)> =
            (0..self.cells.len()).into_par_iter().map(overlap).filter(|(share, _)| *share > ALIKE).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        all.into_iter().take(most).map(|(_, cell)| cell).collect()
    }

    /// The same of a block's columns, from the components that the state has.
    pub fn across_block(&self, block: &Block, state: &State, components: &[&Component]) -> DMatrix<f64> {
        let parts: Vec<DMatrix<f64>> =
            components.iter().map(|own| product(view(&own.part), view(&block.columns.values))).collect();
        let rows = parts.iter().map(DMatrix::nrows).sum();
        let columns = block.columns.values.ncols();
        let mut values = Vec::with_capacity(rows * columns);
        for column in 0..columns {
            for part in &parts {
                values.extend(part.column(column).iter().copied());
            }
        }
        state.solved(DMatrix::from_vec(rows, columns, values))
    }

    pub fn state(&self, components: &[&Component], kappa: Option<f64>) -> State {
        self.parts.know(components, self.frame);
        State::of(components, &self.parts, self.frame, kappa)
    }

    /// The evidence of a cell in all of its shapes beside a state of some components.
    pub fn closely(&self, cell: usize, state: &State, components: &[&Component]) -> Option<CellEvidence> {
        let block = self.fine(cell);
        let across = self.across_block(block, state, components);
        let mut all: Vec<(f64, usize, usize, f64)> = Vec::new();
        // A model holds every number once, by its name.
        let keys: BTreeSet<String> = components.iter().flat_map(|own| &own.forms).map(Form::key).collect();
        let is_there = |group: usize| block.groups[group].group.forms.iter().any(|form| keys.contains(&form.key()));
        let there: Vec<bool> = (0..block.groups.len()).map(|group| !keys.is_empty() && is_there(group)).collect();
        state.shapes(block, &across, 0, |group, shape, found| {
            if !there[group] {
                all.push((found.log, group, shape, found.amplitude));
            }
        });
        // A shape of further numbers only where it is clearly better.
        let price = |group: usize, shape: usize| if block.groups[group].group.shapes[shape].is_bent { *BENDS } else { 0.0 };
        let paid = |one: &&(f64, usize, usize, f64)| one.0 - price(one.1, one.2);
        let best = all.iter().max_by(|a, b| paid(a).total_cmp(&paid(b)))?;
        let log = log_sum(&all.iter().map(|one| one.0).collect::<Vec<_>>());
        let bent = log_sum(&all.iter().filter(|one| price(one.1, one.2) > 0.0).map(|one| one.0).collect::<Vec<_>>());
        Some(CellEvidence { log, bent, shape: (best.1, best.2), amplitude: best.3, refined: None })
    }

    /// The odds of every cell beside a state, closely those of the best and of some more. A cell that has a component already has no price for
    /// another one.
    pub fn scan(&self, state: &State, components: &[&Component], most: usize, also: &[usize]) -> Scan {
        let all: Vec<usize> = (0..self.cells.len()).collect();
        self.scan_some(&all, state, components, most, also)
    }

    /// The odds of cells that do much of what a component does, beside a state without it.
    pub fn scan_alike(&self, own: &Component, state: &State, others: &[&Component], most: usize, also: &[usize]) -> Scan {
        self.scan_some(&self.alike(own, 60), state, others, most, also)
    }

    /// The same of some cells.
    fn scan_some(&self, cells: &[usize], state: &State, components: &[&Component], most: usize, also: &[usize]) -> Scan {
        let prior = |cell: usize| {
            if components.iter().any(|own| own.cell == cell) { 0.0 } else { self.cells[cell].log_prior }
        };
        let (across, first) = self.across_cells(cells, state);
        let bound = |k: usize| prior(cells[k]) + state.bound(&self.coarse[cells[k]], &across, first[k]);
        let bounds: Vec<f64> = (0..cells.len()).into_par_iter().map(bound).collect();
        let coarse = |k: usize| {
            let mut logs = Vec::new();
            state.shapes(&self.coarse[cells[k]], &across, first[k], |_, _, found| logs.push(found.log));
            prior(cells[k]) + log_sum(&logs)
        };
        let mut promising: Vec<usize> = (0..cells.len()).collect();
        promising.sort_by(|a, b| bounds[*b].total_cmp(&bounds[*a]).then(a.cmp(b)));
        let mut log_odds = vec![f64::NEG_INFINITY; self.cells.len()];
        // In turns, until no other cell could come near the best.
        for some in promising.chunks(2 * most) {
            let best = log_odds.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if bounds[some[0]] < (best - FAR_BELOW).max(UNLIKELY) {
                break;
            }
            let found: Vec<(usize, f64)> = some.par_iter().map(|k| (cells[*k], coarse(*k))).collect();
            found.into_iter().for_each(|(cell, log)| log_odds[cell] = log);
        }
        let mut order: Vec<usize> = (0..self.cells.len()).filter(|cell| log_odds[*cell].is_finite()).collect();
        order.sort_by(|a, b| log_odds[*b].total_cmp(&log_odds[*a]).then(a.cmp(b)));
        order.truncate(most);
        order.extend(also.iter().copied().filter(|cell| !order.contains(cell)).collect::<Vec<_>>());
        let closely: BTreeMap<usize, CellEvidence> =
            order.into_par_iter().filter_map(|cell| Some((cell, self.closely(cell, state, components)?))).collect();
        for (cell, found) in &closely {
            log_odds[*cell] = prior(*cell) + found.log;
        }
        let order = promising.into_iter().map(|k| cells[k]).collect();
        let mut scan = Scan { log_odds, closely, order };
        self.refine(&mut scan, state, components, &prior);
        scan
    }

    /// Gives listed shapes that are near the best cell the numbers that say most: a free curve has no numbers to be refined.
    fn refine(&self, scan: &mut Scan, state: &State, components: &[&Component], prior: &(dyn Fn(usize) -> f64 + Sync)) {
        let most = scan.best().map_or(0.0, |best| scan.log_odds[best]);
        let best = scan.best();
        let open = best.is_some_and(|best| !self.cells[best].is_named());
        let near = |cell: &usize| open && scan.log_odds[*cell] > most - (0.2 * most).max(10.0) && scan.log_odds[*cell] > -5.0;
        let named = |cell: &usize| self.cells[*cell].is_named() && (Some(*cell) == best || near(cell));
        let listed: Vec<usize> = scan.closely.keys().copied().filter(named).collect();
        let refined: Vec<(usize, (Form, f64, f64))> = listed
            .into_par_iter()
            .filter_map(|cell| Some((cell, self.refined(cell, &scan.closely[&cell], state, components)?)))
            .collect();
        for (cell, own) in refined {
            let Some(found) = scan.closely.get_mut(&cell) else { continue };
            if own.1 > found.log {
                found.log = own.1;
                scan.log_odds[cell] = prior(cell) + own.1;
            }
            found.refined = Some(own);
        }
    }

    /// The component that a cell is in a scan.
    fn component(&mut self, cell: usize, found: &CellEvidence) -> Component {
        let own = self.as_found(cell, found);
        let Some((form, _, amplitude)) = found.refined.clone() else {
            self.next += 1;
            return own.with_part(self.next);
        };
        let own = Component { forms: vec![form], amplitude, ..own };
        self.component_of(&own, cell)
    }

    /// The same with the numbers of its listed shape.
    fn as_found(&self, cell: usize, found: &CellEvidence) -> Component {
        let block = self.fine(cell);
        let seen = &block.groups[found.shape.0];
        let shape = seen.group.shapes[found.shape.1].clone();
        // Forms that this shape leaves out.
        let mut at = 0;
        let (mut forms, mut counts, mut kept) = (Vec::new(), Vec::new(), Vec::new());
        for (form, count) in seen.group.forms.iter().zip(&seen.counts) {
            let columns = at..at + count;
            at += count;
            if shape.shares[columns.clone()].iter().any(|share| *share > 0.0) {
                forms.push(form.clone());
                counts.push(*count);
                kept.extend(columns);
            }
        }
        let values = block.columns.values.select_columns(kept.iter().map(|k| seen.range.start + k).collect::<Vec<_>>().iter());
        let square = kept.iter().map(|k| block.columns.square[seen.range.start + k]).collect();
        let shares = kept.iter().map(|k| shape.shares[*k]).collect();
        let shape = super::cell::Shape { shares, ..shape };
        let group = super::cell::ShapeGroup { forms: forms.clone(), shapes: vec![shape.clone()], ..seen.group.clone() };
        Component {
            id: 0,
            cell,
            forms,
            counts,
            shape,
            group: Arc::new(group),
            values: Arc::new(values),
            square: Arc::new(square),
            amplitude: found.amplitude,
            part: Arc::default(),
        }
    }

    /// A component with other forms, before it has a part in the covariance.
    fn with_forms(&self, before: &Component, forms: Vec<Form>) -> Component {
        let (columns, counts) = self.frame.columns(&forms);
        Component { forms, counts, values: Arc::new(columns.values), square: Arc::new(columns.square), ..before.clone() }
    }

    /// A component of given forms, e.g. of the model before.
    pub fn component_of(&mut self, before: &Component, cell: usize) -> Component {
        self.next += 1;
        Component { cell, ..self.with_forms(before, before.forms.clone()) }.with_part(self.next)
    }

    /// ln of the evidence of one shape with its weight beside a state, and its amplitude.
    fn of_component(&self, own: &Component, state: &State, others: &[&Component]) -> Option<(f64, f64)> {
        let block = Block::of_component(own, self.frame);
        let across = self.across_block(&block, state, others);
        let mut found = None;
        state.shapes(&block, &across, 0, |_, _, own| found = Some((own.log, own.amplitude)));
        found
    }

    /// The shape of a cell with its numbers where the evidence is largest, with ln of that and its amplitude; none where it has no numbers.
    fn refined(&self, cell: usize, found: &CellEvidence, state: &State, others: &[&Component]) -> Option<(Form, f64, f64)> {
        const LEVELS: i32 = 5;
        let mut best = self.as_found(cell, found);
        let [form] = &best.forms[..] else { return None };
        let mut form = form.clone();
        if form.cause().is_nameless() {
            return None;
        }
        let keys: BTreeSet<String> = others.iter().flat_map(|own| &own.forms).map(Form::key).collect();
        let (mut log, mut amplitude) = self.of_component(&best, state, others)?;
        let mut moved = false;
        for level in 0..LEVELS {
            loop {
                let near = form.near(self.survey, level);
                let tried = near.into_iter().filter(|near| !keys.contains(&near.key())).filter_map(|near| {
                    let other = self.with_forms(&best, vec![near.clone()]);
                    self.of_component(&other, state, others).map(|(log, amplitude)| (log, amplitude, near))
                });
                let leaves_whole = |near: &Form| is_whole_order(&form) && !is_whole_order(near);
                let paid = |(log, _, near): &(f64, f64, Form)| log - if leaves_whole(near) { *BENDS } else { 0.0 };
                let Some(next) = tried.max_by(|a, b| paid(a).total_cmp(&paid(b))) else { break };
                if paid(&next) <= log + 1e-6 {
                    break;
                }
                let gained = next.0 - log;
                (log, amplitude, form) = next;
                best.forms = vec![form.clone()];
                moved = true;
                if gained < 0.05 {
                    break;
                }
            }
        }
        moved.then_some((form, log, amplitude))
    }

    /// Every component anew beside all others: shape and amplitude.
    pub fn backfit(&mut self, components: Vec<Component>, rounds: usize) -> Vec<Component> {
        let all = (0..components.len()).collect::<Vec<_>>();
        self.backfit_some(components, &all, rounds)
    }

    /// The newest component and those that do in part what it does.
    fn backfit_newest(&mut self, components: Vec<Component>) -> Vec<Component> {
        const COUPLED: f64 = 0.01;
        let Some(newest) = components.last() else { return components };
        self.parts.know(&components.iter().collect::<Vec<_>>(), self.frame);
        let coupled = |i: &usize| self.parts.overlap(&components[*i], newest) > COUPLED;
        let some: Vec<usize> = (0..components.len()).filter(coupled).collect();
        self.backfit_some(components, &some, 1)
    }

    fn backfit_some(&mut self, mut components: Vec<Component>, some: &[usize], rounds: usize) -> Vec<Component> {
        for _ in 0..rounds {
            let kappa = self.state(&components.iter().collect::<Vec<_>>(), None).kappa;
            let mut changed = false;
            for i in some.iter().copied() {
                let others: Vec<Component> = without(&components, &[i]);
                let others: Vec<&Component> = others.iter().collect();
                let state = self.state(&others, Some(kappa));
                let own = self.of_component(&components[i], &state, &others);
                let Some(own) = own else { continue };
                let before = (components[i].amplitude, components[i].shape.shares.clone());
                components[i].amplitude = own.1;
                let Some(mut grid) = self.closely(components[i].cell, &state, &others) else { continue };
                let found = self.as_found(components[i].cell, &grid);
                let same = found.forms == components[i].forms && found.shape.shares.len() == components[i].shape.shares.len();
                if same {
                    let Component { shape, group, amplitude, .. } = found.clone();
                    components[i] = Component { shape, group, amplitude, ..components[i].clone() };
                }
                if before != (components[i].amplitude, components[i].shape.shares.clone()) {
                    self.next += 1;
                    components[i] = components[i].clone().with_part(self.next);
                    changed = true;
                }
                if same {
                    continue;
                }
                let Some(other) = self.of_component(&found, &state, &others) else { continue };
                if other.0 > own.0 + *SWAPS {
                    grid.refined = self.refined(components[i].cell, &grid, &state, &others);
                    components[i] = self.component(components[i].cell, &grid);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        self.know(&components);
        components
    }

    /// Where the strongest cell is one of loads, every joint that yields to its own: one link that bends may look better than any one joint, and
    /// worse than all of them. Nothing else.
    pub fn start(&mut self) -> Vec<Component> {
        let state = self.state(&[], None);
        let scan = self.scan(&state, &[], *CLOSELY, &[]);
        let loads = |form: &Form| form.variables().iter().any(|of| matches!(of, Variable::Load { .. } | Variable::ArmLoad));
        let by_load = |best: usize| {
            let found = self.as_found(best, &scan.closely[&best]);
            scan.log_odds[best] > *JOINS && found.forms.iter().any(loads)
        };
        if !scan.best().is_some_and(by_load) {
            return Vec::new();
        }
        let yields: Vec<usize> = (0..self.cells.len()).filter(|cell| self.cells[*cell].name == names::JOINT_COMPLIANCE).collect();
        let mut components = Vec::new();
        for cell in yields {
            if let Some(mut found) = self.closely(cell, &state, &[]) {
                found.shape = (0, 0);
                components.push(self.component(cell, &found));
            }
        }
        components = self.backfit(components, 2);
        self.prune(components)
    }

    /// Adds cells while they pay. What is smaller than the second order of what this round has found already waits for the next round, which
    /// is around a model that has that in it.
    pub fn grow(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        self.know(&components);
        let (mut likely, mut has_grown): (Vec<usize>, bool) = ((0..self.cells.len()).collect(), false);
        while components.len() < *COMPONENTS {
            let now: Vec<&Component> = components.iter().collect();
            let state = self.state(&now, None);
            let mut scan = self.scan_some(&likely, &state, &now, *CLOSELY, &[]);
            // A misjudged noise makes everything seem likely.
            let price = *JOINS * (1.0 + 2.0 * state.kappa.clamp(1.0, 4.0).ln());
            if likely.len() < self.cells.len() && scan.best().is_none_or(|best| scan.log_odds[best] < price) {
                scan = self.scan(&state, &now, *CLOSELY, &[]);
            }
            // What was unlikely before is asked again when the likely ones are used up.
            likely = scan.order.iter().copied().take(LIKELY).collect();
            let Some(best) = scan.best() else { break };
            let numbers: usize = components.iter().map(|own| own.part.ncols()).sum();
            // So many numbers describe rows and explain nothing.
            if 3.0 * numbers as f64 > state.rows.freedom {
                break;
            }
            if scan.log_odds[best] < price {
                break;
            }
            let found = scan.closely[&best].clone();
            let new = components.iter().filter(|own| !self.from_before.contains(&self.cells[own.cell].key));
            let moved: f64 = new.map(|own| own.amplitude.powi(2)).sum();
            if found.amplitude < *SECOND_ORDER * moved {
                break;
            }
            components.push(self.component(best, &found));
            components = self.backfit_newest(components);
            has_grown = true;
        }
        if !has_grown {
            return components;
        }
        components = self.backfit(components, 2);
        self.prune(components)
    }

    /// Drops cells that no longer pay.
    fn prune(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        loop {
            if components.is_empty() {
                return components;
            }
            let kappa = self.state(&components.iter().collect::<Vec<_>>(), None).kappa;
            let odds: Vec<f64> = (0..components.len()).map(|i| self.log_odds_of(&components, i, kappa)).collect();
            let least = (0..odds.len()).min_by(|a, b| odds[*a].total_cmp(&odds[*b])).unwrap_or(0);
            if odds[least] > *LEAVES {
                return components;
            }
            components = self.backfit(without(&components, &[least]), 2);
        }
    }

    /// ln of the odds of a component beside all others.
    fn log_odds_of(&self, components: &[Component], i: usize, kappa: f64) -> f64 {
        let others = without(components, &[i]);
        let others: Vec<&Component> = others.iter().collect();
        let state = self.state(&others, Some(kappa));
        let cell = components[i].cell;
        let again = others.iter().any(|other| other.cell == cell);
        let prior = if again { 0.0 } else { self.cells[cell].log_prior };
        prior + self.log_evidence(&components[i], &state, &others)
    }

    /// ln of the evidence of a component's cell, its refined shape among the others.
    pub fn log_evidence(&self, own: &Component, state: &State, others: &[&Component]) -> f64 {
        let grid = self.closely(own.cell, state, others).map_or(f64::NEG_INFINITY, |found| found.log);
        self.of_component(own, state, others).map_or(grid, |(log, _)| grid.max(log))
    }

    /// Exchanges components for cells that say more in their place.
    pub fn swap(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        const ROUNDS: usize = 8;
        let key = |components: &[Component]| {
            let mut cells: Vec<usize> = components.iter().map(|own| own.cell).collect();
            cells.sort_unstable();
            cells
        };
        let mut seen = BTreeSet::from([key(&components)]);
        'rounds: for _ in 0..ROUNDS {
            self.know(&components);
            let kappa = self.state(&components.iter().collect::<Vec<_>>(), None).kappa;
            let mut order: Vec<usize> = (0..components.len()).collect();
            order.sort_by(|a, b| components[*a].amplitude.total_cmp(&components[*b].amplitude));
            for i in order {
                let own = components[i].cell;
                let others = without(&components, &[i]);
                let rest: Vec<&Component> = others.iter().collect();
                let state = self.state(&rest, Some(kappa));
                let alike = self.alike(&components[i], 24);
                let scan = self.scan_some(&alike, &state, &rest, 5, &[own]);
                let Some(best) = scan.best() else { continue };
                let again = rest.iter().any(|other| other.cell == own);
                let prior = if again { 0.0 } else { self.cells[own].log_prior };
                let stays = prior + self.log_evidence(&components[i], &state, &rest);
                if best == own || scan.log_odds[best] <= stays + *SWAPS {
                    continue;
                }
                let found = scan.closely[&best].clone();
                let new = self.component(best, &found);
                let mut next = others.clone();
                next.push(new);
                let next = self.backfit(next, 1);
                if seen.insert(key(&next)) {
                    components = next;
                    continue 'rounds;
                }
            }
            break;
        }
        self.prune(components)
    }

    /// ln of the posterior of a set of components, up to a constant, at a noise.
    fn total(&self, components: &[Component], kappa: f64) -> f64 {
        let state = self.state(&components.iter().collect::<Vec<_>>(), Some(kappa));
        let mut prior = 0.0;
        for (i, own) in components.iter().enumerate() {
            let first = !components[..i].iter().any(|other| other.cell == own.cell);
            prior += if first { self.cells[own.cell].log_prior } else { 0.0 };
            prior += own.shape.log_weight - (AMPLITUDES as f64).ln();
        }
        let half = 0.5 * (state.rows.freedom + *NU);
        prior - state.log_determinant() - half * (*NU + state.rows.square).ln()
    }

    /// A free curve of a joint's own angle that up to three waves replace is a gear's.
    pub fn periodic(&mut self, mut components: Vec<Component>) -> Vec<Component> {
        const WAVES: usize = 3;
        let curves: Vec<u64> = components.iter().filter(|own| self.is_own_curve(own)).map(|own| own.id).collect();
        for id in curves {
            let Some(at) = components.iter().position(|own| own.id == id) else { continue };
            let place = self.cells[components[at].cell].place;
            let gear = |cell: &Cell| cell.place == place && cell.key.starts_with(names::GEAR_CYCLIC);
            let Some(gear) = self.cells.iter().position(gear) else { continue };
            let kappa = self.state(&components.iter().collect::<Vec<_>>(), None).kappa;
            let before = self.total(&components, kappa);
            let mut next = without(&components, &[at]);
            for _ in 0..WAVES {
                let rest: Vec<&Component> = next.iter().collect();
                let state = self.state(&rest, Some(kappa));
                let Some(mut found) = self.closely(gear, &state, &rest) else { break };
                found.refined = self.refined(gear, &found, &state, &rest);
                next.push(self.component(gear, &found));
                next = self.backfit(next, 1);
                if self.total(&next, kappa) > before {
                    components = next;
                    break;
                }
            }
        }
        self.know(&components);
        components
    }

    fn is_own_curve(&self, own: &Component) -> bool {
        let Shapes::Free(free) = &self.cells[own.cell].shapes else { return false };
        let crate::effect::Motion::Joint { joint } = free.motion else { return false };
        free.of == Variable::Angle { joint } && matches!(free.over, super::cell::Over::Curve { .. })
    }

    /// Motions over a variable that show, whose products are not cells yet.
    pub fn shown(&self, components: &[Component]) -> Vec<FreeShape> {
        // What has become a product still shows by its first variable.
        let products = components.iter().filter_map(|own| match &self.cells[own.cell].shapes {
            Shapes::Free(free) if matches!(free.over, super::cell::Over::Product(_)) => Some((free.motion, free.of)),
            _ => None,
        });
        let products: Vec<_> = products.collect();
        let stays = |shown: &&FreeShape| products.iter().any(|(motion, of)| *motion == shown.motion && *of == shown.of);
        let mut out: Vec<FreeShape> = self.multiplied.iter().filter(stays).copied().collect();
        let most = components.iter().map(|own| own.amplitude).fold(0.0, f64::max);
        for own in components.iter().filter(|own| own.amplitude > 2.0 * *TRACE * most) {
            let free = match &self.cells[own.cell].shapes {
                Shapes::Free(free) if !matches!(free.over, super::cell::Over::Product(_)) => Some(*free),
                Shapes::Free(_) => None,
                Shapes::Listed(_) => own.forms.first().and_then(|form| {
                    let term = form.term().filter(|term| term.law().times.is_none())?;
                    let of = term.law().first.of;
                    Some(FreeShape { motion: term.motion(), of, over: super::cell::Over::Line }).filter(|_| of.is_single())
                }),
            };
            if let Some(free) = free
                && !out.iter().any(|other| other.motion == free.motion && other.of == free.of)
            {
                out.push(free);
            }
        }
        out
    }
}

/// Whether a form is a wave of whole periods a turn.
fn is_whole_order(form: &Form) -> bool {
    matches!(form.term().map(|term| term.basis()), Some(Basis::Wave { .. }))
}

/// Components without some of them.
pub(super) fn without(components: &[Component], out: &[usize]) -> Vec<Component> {
    (0..components.len()).filter(|i| !out.contains(i)).map(|i| components[i].clone()).collect()
}
