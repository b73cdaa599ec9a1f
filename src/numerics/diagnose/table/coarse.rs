//! Products of components with the coarse columns of cells, computed on first use: a search evaluates most cells only a few times.

use super::cause_table::CauseTable;
use super::component::{CellColumns, Component};
use super::state::KnownState;
use crate::criteria::cells::{ALIKE, COMPONENTS};
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// What is known of each component, by its number.
#[derive(Default)]
pub(super) struct CoarseProducts(Mutex<KnownParts>);

#[derive(Default)]
struct KnownParts {
    /// With the turn of its last use.
    of: BTreeMap<u64, (u64, Arc<PartOfCells>)>,
    turn: u64,
}

/// Products of the part of a component with the coarse columns of cells.
#[derive(Clone, Default)]
struct PartOfCells {
    /// Columns of the part x coarse columns of all cells; zero where not computed yet.
    values: DMatrix<f64>,
    is_known: Vec<bool>,
}

impl CoarseProducts {
    /// What is known of a component.
    fn get(&self, id: u64) -> Option<Arc<PartOfCells>> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        known.turn += 1;
        let turn = known.turn;
        let (last, part) = known.of.get_mut(&id)?;
        *last = turn;
        Some(part.clone())
    }

    /// The same to be added to.
    fn take(&self, id: u64) -> PartOfCells {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let part = known.of.remove(&id).map(|(_, part)| part);
        part.map(Arc::unwrap_or_clone).unwrap_or_default()
    }

    /// Stores the products of a component; the half that was not used for longest is dropped when there are too many.
    fn keep(&self, id: u64, part: Arc<PartOfCells>) {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let turn = known.turn;
        known.of.insert(id, (turn, part));
        if known.of.len() > 2 * *COMPONENTS {
            let mut turns: Vec<u64> = known.of.values().map(|(turn, _)| *turn).collect();
            turns.sort_unstable();
            let least = turns[turns.len() / 2];
            known.of.retain(|_, (turn, _)| *turn >= least);
        }
    }
}

impl CauseTable<'_, '_> {
    /// Products of the part of a component with the coarse columns of some cells.
    fn part_of_cells(&self, component: &Component, cells: &[usize]) -> Arc<PartOfCells> {
        let known = self.products.get(component.id).unwrap_or_default();
        let is_known = |cell: &usize| known.is_known.get(*cell).copied().unwrap_or(false);
        let mut missing: Vec<usize> = cells.to_vec();
        missing.retain(|cell| !is_known(cell));
        if missing.is_empty() {
            return known;
        }
        // What a component has in common with the directions of a motion is computed once for all cells of that.
        let mut of_motions: BTreeMap<Result<usize, usize>, Vec<usize>> = BTreeMap::new();
        for cell in missing {
            let motion = self.coarse[cell].motion().ok_or(cell);
            of_motions.entry(motion).or_default().push(cell);
        }
        let of_motions: Vec<Vec<usize>> = of_motions.into_values().collect();
        let of_motion = |cells: &Vec<usize>| {
            let columns = self.frame.multiplied(vec![&component.values]);
            let blocks: Vec<_> = cells.iter().map(|cell| &self.coarse[*cell]).collect();
            let products = self.known.of_each(component, &columns, &blocks, self.frame);
            let products = products.iter().map(|product| component.by_part(product));
            cells.iter().copied().zip(products).collect::<Vec<_>>()
        };
        let fresh = of_motions.par_iter().flat_map_iter(of_motion);
        let fresh: Vec<(usize, DMatrix<f64>)> = fresh.collect();
        drop(known);
        let mut known = self.products.take(component.id);
        let rows = component.part.ncols();
        if known.values.is_empty() {
            known.values = DMatrix::from_vec(rows, self.columns, vec![0.0; rows * self.columns]);
        }
        known.values.resize_horizontally_mut(self.columns, 0.0);
        known.is_known.resize(self.cells.len(), false);
        for (cell, products) in fresh {
            let first = rows * self.first[cell];
            let values = &mut known.values.as_mut_slice()[first..first + products.len()];
            values.copy_from_slice(products.as_slice());
            known.is_known[cell] = true;
        }
        let known = Arc::new(known);
        self.products.keep(component.id, known.clone());
        known
    }

    /// L^-1 Z'X of the coarse columns of some cells given a state, with the first column of each.
    pub(crate) fn across_cells(
        &self,
        cells: &[usize],
        state: &KnownState,
    ) -> (DMatrix<f64>, Vec<usize>) {
        let components = state.components.iter();
        let known: Vec<Arc<PartOfCells>> = components
            .map(|component| self.part_of_cells(component, cells))
            .collect();
        let parts: Vec<&DMatrix<f64>> = known.iter().map(|known| &known.values).collect();
        let mut first = Vec::with_capacity(cells.len());
        let mut columns = Vec::new();
        for cell in cells {
            first.push(columns.len());
            columns.extend(self.coarse_columns(*cell));
        }
        let solved: Vec<DMatrix<f64>> = columns
            .par_chunks(512)
            .map(|some| state.solved(stacked(&parts, some.iter().copied())))
            .collect();
        let rows: usize = parts.iter().map(|part| part.nrows()).sum();
        let mut values = Vec::with_capacity(rows * columns.len());
        for part in &solved {
            values.extend_from_slice(part.as_slice());
        }
        (DMatrix::from_vec(rows, columns.len(), values), first)
    }

    /// L^-1 Z'X of a block given a state.
    pub(crate) fn across_block(&self, block: &CellColumns, state: &KnownState) -> DMatrix<f64> {
        let part = |component: &Component| {
            let columns = self.frame.multiplied(vec![&component.values]);
            let known = &self.known;
            let products = known.of_each(component, &columns, &[block], self.frame);
            component.by_part(&products[0])
        };
        let parts: Vec<DMatrix<f64>> = state.components.iter().map(part).collect();
        let parts: Vec<&DMatrix<f64>> = parts.iter().collect();
        state.solved(stacked(&parts, 0..block.count()))
    }

    /// The coarse columns of a cell among those of all.
    fn coarse_columns(&self, cell: usize) -> std::ops::Range<usize> {
        self.first[cell]..self.first[cell] + self.coarse[cell].count()
    }

    /// Cells that do most of what a component does, so many of them at most.
    pub(crate) fn alike(&self, component: &Component, most: usize) -> Vec<usize> {
        let all = self.overlaps(component).into_iter();
        all.take(most).map(|(_, cell)| cell).collect()
    }

    /// Cells that do much of what a component does with their shares of its squared motion, those that do most first.
    pub(crate) fn overlaps(&self, component: &Component) -> Vec<(f64, usize)> {
        // Its likeliest motion, of unit length, in the directions of its part.
        let state = self.state(std::slice::from_ref(component), None);
        let Some(weights) = state.weights() else {
            return Vec::new();
        };
        let motion = &**component.part * &weights;
        let length = motion.norm().max(f64::MIN_POSITIVE);
        let cells: Vec<usize> = (0..self.cells.len()).collect();
        let known = self.part_of_cells(component, &cells);
        let along: Vec<f64> = known
            .values
            .tr_mul(&weights)
            .iter()
            .map(|value| value / length)
            .collect();
        let overlap = |cell: usize| {
            let along = &along[self.coarse_columns(cell)];
            (self.coarse[cell].overlap(along), cell)
        };
        let mut all: Vec<(f64, usize)> = cells
            .into_par_iter()
            .map(overlap)
            .filter(|(share, _)| *share > *ALIKE)
            .collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        all
    }
}

/// Some columns of matrices that stand on each other.
fn stacked(parts: &[&DMatrix<f64>], columns: impl ExactSizeIterator<Item = usize>) -> DMatrix<f64> {
    let rows: usize = parts.iter().map(|part| part.nrows()).sum();
    let count = columns.len();
    let mut values = Vec::with_capacity(rows * count);
    for column in columns {
        for part in parts {
            let rows = part.nrows();
            values.extend_from_slice(&part.as_slice()[column * rows..(column + 1) * rows]);
        }
    }
    DMatrix::from_vec(rows, count, values)
}
