//! All cells of a recording with their columns, and the products of these with components of a model.

use super::cell::{CauseCell, FreeShape, Over, ShapeGroup, Shapes};
use super::coarse::CoarseProducts;
use super::component::{CellColumns, ColumnProducts, Component, PartProducts};
use super::frame::{MultipliedColumns, SearchRows};
use super::state::KnownState;
use super::{generated, listed};
use crate::criteria::cells::{CLOSELY, USUAL_MOST};
use crate::diagnose::types::{KnownCell, Question};
use crate::effect::{Survey, Term, Variable, cause, names};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::AtomicU64;
use std::sync::{Mutex, OnceLock};

/// The table of cells over the rows of a recording.
pub(super) struct CauseTable<'f, 'a> {
    pub(crate) frame: &'f SearchRows<'a>,
    pub(crate) survey: &'f Survey<'f>,
    pub(crate) cells: Vec<CauseCell>,
    pub(crate) coarse: Vec<CellColumns>,
    fine: Vec<OnceLock<CellColumns>>,
    pub(super) products: CoarseProducts,
    pub(crate) parts: PartProducts,
    pub(super) known: ColumnProducts,
    /// The first of all coarse columns of each cell, and their number.
    pub(crate) first: Vec<usize>,
    pub(super) columns: usize,
    /// Components that no other cell comes near to replacing, each with the numbers of the components that it overlaps.
    pub(super) firm: Mutex<BTreeMap<u64, Vec<u64>>>,
    /// The number of the next component.
    pub(crate) next: AtomicU64,
    /// Keys of cells that are in the model around which the rows are looked at.
    pub(crate) from_before: Vec<String>,
    /// Cells of effects that the user declares.
    pub(crate) declared: Vec<usize>,
    /// Motions and variables whose products with others are cells.
    pub(crate) multiplied: Vec<FreeShape>,
    /// Whether nothing joins any more: the residual is noise.
    pub(crate) is_closed: bool,
    /// Whether curves may have steps: once all that is smooth was asked.
    pub(crate) has_steps: bool,
    /// What a joint that yields out of proportion to its load is called.
    pub(crate) bent: &'static str,
    /// Whether a curve over a joint's own angle has a name.
    pub(crate) has_tables: bool,
}

impl<'f, 'a> CauseTable<'f, 'a> {
    /// All cells of a recording.
    pub(crate) fn new(
        frame: &'f mut SearchRows<'a>,
        survey: &'f Survey<'f>,
        question: &Question,
        (shown, pairs): (&[FreeShape], Vec<CauseCell>),
        is_open: bool,
        keeps: impl Fn(&CauseCell) -> bool,
    ) -> Self {
        let mut cells = generated::cells(survey, frame, question, is_open);
        cells.extend(generated::products(shown, survey, frame));
        let mut known: BTreeSet<String> = cells.iter().map(|cell| cell.key.clone()).collect();
        let is_new = |cell: &CauseCell| known.insert(cell.key.clone());
        cells.extend(pairs.into_iter().filter(is_new));
        let values = |variable: Variable| frame.values(variable);
        let mut named = listed::cells(survey, &values, question);
        named.append(&mut cells);
        named.retain(keeps);
        for cell in &mut named {
            let is_it = |known: &&KnownCell| known.cell == cell.key;
            if let Some(known) = question.known.iter().find(is_it) {
                // However usual a cause is, a recording has to show something of it.
                let probability = known.probability.clamp(1e-6, *USUAL_MOST);
                cell.log_prior = (probability / (1.0 - probability)).ln();
                cell.between = Some(known.between);
            }
        }
        let groups = named.iter().map(|cell| cell.groups(survey, &values, false));
        let groups: Vec<Vec<ShapeGroup>> = groups.collect();
        let forms = groups.iter().flatten().flat_map(|group| &group.forms);
        let terms: Vec<&Term> = forms.filter_map(|form| form.term()).collect();
        let mut motions = Vec::new();
        let mut variables = Vec::new();
        for term in &terms {
            if !motions.contains(&term.motion()) {
                motions.push(term.motion());
            }
            for variable in term.law().factors().map(|factor| factor.variable) {
                if variable.is_single() && !variables.contains(&variable) {
                    variables.push(variable);
                }
            }
        }
        frame.prepare(&motions, &variables);
        frame.tabulate(terms.iter().map(|term| term.law()));
        let is_declared = |cell: &CauseCell| cell.is_named() && cause(&cell.name).is_none();
        let declared = (0..named.len()).filter(|cell| is_declared(&named[*cell]));
        let excludes = |name: &str| question.without.iter().any(|out| out == name);
        let mut table = Self {
            frame,
            survey,
            cells: Vec::new(),
            coarse: Vec::new(),
            fine: Vec::new(),
            products: CoarseProducts::default(),
            parts: PartProducts::default(),
            known: ColumnProducts::default(),
            first: Vec::new(),
            columns: 0,
            firm: Mutex::default(),
            next: AtomicU64::new(1),
            declared: declared.collect(),
            from_before: Vec::new(),
            multiplied: shown.to_vec(),
            is_closed: false,
            has_steps: false,
            bent: match excludes(names::JOINT_HARDENING) {
                true => names::UNKNOWN,
                false => names::JOINT_HARDENING,
            },
            has_tables: !excludes(names::JOINT_TABLE),
        };
        table.extend(named.into_iter().zip(groups).collect());
        table
    }

    /// Adds cells with their groups of shapes.
    fn extend(&mut self, cells: Vec<(CauseCell, Vec<ShapeGroup>)>) {
        let block = |(cell, groups): (CauseCell, Vec<ShapeGroup>)| {
            let block = CellColumns::of(groups, self.frame).between(cell.between);
            (cell, block)
        };
        let blocks: Vec<(CauseCell, CellColumns)> = cells.into_par_iter().map(block).collect();
        for (cell, block) in blocks {
            self.first.push(self.columns);
            self.columns += block.count();
            self.fine.push(OnceLock::new());
            self.coarse.push(block);
            self.cells.push(cell);
        }
    }

    /// A component's product with the numbers that its variables have; none of what is no product.
    pub(crate) fn product(&self, component: &Component) -> Option<FreeShape> {
        let free = self.cells[component.cell].free()?;
        let law = component.forms.first()?.term()?.law();
        let times = law.times.filter(|_| free.is_product())?;
        Some(FreeShape {
            variable: law.first.variable,
            over: Over::Product(times.variable),
            ..*free
        })
    }

    /// The groups of shapes of a motion; all of them if `closely`.
    pub(super) fn groups(&self, free: &FreeShape, closely: bool) -> Vec<ShapeGroup> {
        free.groups(
            self.survey,
            &|variable| self.frame.values(variable),
            closely,
        )
    }

    /// Cells that may do what a product does; none of what is no product.
    pub(crate) fn siblings(&self, component: &Component) -> Vec<usize> {
        let product = self.product(component);
        let siblings = product.map(|free| generated::siblings(&free, self.survey));
        let known = |free| self.cell(&generated::cell(free, 0.0, self.survey).key);
        siblings.into_iter().flatten().filter_map(known).collect()
    }

    /// Adds cells that may do what products among the components do, each as probable beforehand as that, less some; whether there are any.
    pub(crate) fn add_siblings(
        &mut self,
        components: &[Component],
        without: &BTreeSet<String>,
    ) -> bool {
        let mut fresh: Vec<(CauseCell, Vec<ShapeGroup>)> = Vec::new();
        for component in components {
            let Some(free) = self.product(component) else {
                continue;
            };
            let log_prior = self.cells[component.cell].log_prior;
            for free in generated::siblings(&free, self.survey) {
                let cell = generated::cell(free, log_prior, self.survey);
                if without.contains(&cell.key) {
                    continue;
                }
                let known = self.cells.iter_mut();
                let mut known = known.chain(fresh.iter_mut().map(|(cell, _)| cell));
                if let Some(known) = known.find(|known| known.key == cell.key) {
                    known.log_prior = known.log_prior.max(log_prior);
                    continue;
                }
                let groups = self.groups(&free, false);
                if !groups.is_empty() {
                    fresh.push((cell, groups));
                }
            }
        }
        let any = !fresh.is_empty();
        if any {
            self.firm = Mutex::default();
            self.extend(fresh);
        }
        any
    }

    /// The cell of a key.
    pub(crate) fn cell(&self, key: &str) -> Option<usize> {
        self.cells.iter().position(|cell| cell.key == key)
    }

    pub(super) fn fine(&self, cell: usize) -> &CellColumns {
        if !self.cells[cell].is_coarse() {
            return &self.coarse[cell];
        }
        self.fine[cell].get_or_init(|| {
            let values = |variable: Variable| self.frame.values(variable);
            let groups = self.cells[cell].groups(self.survey, &values, true);
            CellColumns::of(groups, self.frame).between(self.cells[cell].between)
        })
    }

    /// Cells with a name at the place of a component, and of a curve those over its variable there or next to it: columns that are looked at
    /// coarsely do not show how alike fine curves are.
    pub(crate) fn near(&self, component: &Component) -> Vec<usize> {
        let followed = |cell: &CauseCell| match &cell.shapes {
            Shapes::Free(free) => free.is_curve().then_some(free.variable),
            Shapes::Listed(groups) => {
                let law = groups.first()?.forms.first()?.term()?.law();
                law.times.is_none().then_some(law.first.variable)
            }
        };
        let cell = &self.cells[component.cell];
        let variable = cell.free().and_then(|_| followed(cell));
        let near = |other: &CauseCell| {
            variable.is_some()
                && followed(other) == variable
                && generated::are_near(cell.place, other.place, 2, self.survey)
        };
        let named_here = |other: &CauseCell| other.is_named() && other.place == cell.place;
        (0..self.cells.len())
            .filter(|k| near(&self.cells[*k]) || named_here(&self.cells[*k]))
            .collect()
    }

    /// Other motions over a variable with numbers that a component follows: coarsely asked they have other numbers; the most promising of them
    /// given a state of others.
    pub(crate) fn over_its_variable(
        &self,
        component: &Component,
        state: &KnownState,
    ) -> Vec<usize> {
        let free = self.cells[component.cell].free();
        let Some(free) = free.filter(|free| free.is_curve() && !free.near(0).is_empty()) else {
            return Vec::new();
        };
        let same = |other: &FreeShape| other.is_curve() && other.variable.is_alike(free.variable);
        let all: Vec<usize> = (0..self.cells.len())
            .filter(|cell| self.cells[*cell].free().is_some_and(same))
            .collect();
        let mut promising = self.promising(&all, state);
        promising.truncate(2 * *CLOSELY);
        promising
    }

    /// L^-1 Z'X of a block that is asked once, by the columns of the state.
    pub(crate) fn across_once(
        &self,
        block: &CellColumns,
        state: &KnownState,
        columns: &MultipliedColumns,
    ) -> DMatrix<f64> {
        state.solved(block.products(columns, self.frame))
    }

    pub(crate) fn state(&self, components: &[Component], kappa: Option<f64>) -> KnownState {
        self.parts.know(components.iter(), self.frame);
        KnownState::of(components.to_vec(), &self.parts, self.frame, kappa)
    }
}
