//! Rows around a fit by their products alone: what is needed of them is a few small matrices, however many there are.

use crate::{Accepted, Cell, EvidenceRows, Scanned, evidence, log_sum};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Whitened rows: their residual, and what is free under its tolerance already.
pub struct Rows {
    /// Squared residual.
    pub square: f64,
    /// Degrees of freedom.
    pub freedom: f64,
    /// Share of the rows that is independent.
    pub independence: f64,
    /// rms of a unit of amplitude, in units of the unwhitened rows.
    pub unit: f64,
    /// Gradient of the base.
    gradient: DVector<f64>,
    /// Of the base's products and the precision of its tolerance.
    factor: Option<Cholesky<f64, Dyn>>,
}

/// Columns of a shape by their products.
#[derive(Debug, Clone)]
pub struct Block {
    /// Of the columns with each other.
    pub gram: DMatrix<f64>,
    /// With the residual.
    pub gradient: DVector<f64>,
    /// Of the base with them.
    pub cross: DMatrix<f64>,
    /// Their rms, unwhitened, each.
    pub rms: Vec<f64>,
}

impl Rows {
    /// Rows by their residual and the base's products; `precision` is that of its tolerances.
    pub fn new(
        (square, freedom): (f64, f64),
        gram: &DMatrix<f64>,
        gradient: DVector<f64>,
        precision: &DVector<f64>,
    ) -> Self {
        let whole = gram + DMatrix::from_diagonal(precision);
        let factor = (!gradient.is_empty()).then(|| whole.cholesky()).flatten();
        let explained = factor
            .as_ref()
            .map_or(0.0, |factor| gradient.dot(&factor.solve(&gradient)));
        Self {
            square: (square - explained).max(0.0),
            freedom,
            independence: 1.0,
            unit: 1.0,
            gradient,
            factor,
        }
    }

    /// ln of the evidence of a block, the base projected off, and the likeliest coefficients of its columns.
    pub fn evidence(&self, block: &Block) -> (f64, Vec<f64>) {
        let (mut gram, mut gradient) = (block.gram.clone(), block.gradient.clone());
        if let Some(factor) = &self.factor {
            let solved = factor.solve(&block.cross);
            gram -= block.cross.tr_mul(&solved);
            gradient -= solved.tr_mul(&self.gradient);
        }
        let count = gram.nrows();
        let rms = block.rms.iter().fold(0.0_f64, |most, rms| most.max(*rms));
        if rms <= 0.0 || count == 0 {
            return (0.0, vec![0.0; count]);
        }
        // In the amplitudes of the table: a unit is `unit` rms.
        let scale = self.unit / rms;
        let share = 1.0 / count as f64;
        let by = self.independence;
        let found = evidence(
            &(&gram * (scale * scale * by)),
            &(&gradient * (scale * by)),
            &vec![share; count],
            EvidenceRows {
                freedom: self.freedom * by,
                square: self.square * by,
            },
        );
        let prior = (found.amplitude * scale).powi(2) * share;
        let ridge = 1.0 / (by * prior).max(1e-300);
        let whole = gram + DMatrix::from_diagonal_element(count, count, ridge);
        let size = whole.cholesky().map(|factor| factor.solve(&gradient));
        let size = size.map_or(vec![0.0; count], |size| size.iter().copied().collect());
        (found.log, size)
    }
}

/// A cell with the evidence and the numbers of each of its shapes.
pub type CellAnswers<K> = (Cell<K>, Vec<(f64, Vec<f64>)>);

/// Scanned cells, likeliest first: of each the likeliest shape begins a fit, all of them count.
pub fn ranked<K: Clone>(cells: Vec<CellAnswers<K>>) -> Vec<Scanned<K>> {
    let mut all: Vec<Scanned<K>> = cells
        .into_iter()
        .filter_map(|(cell, shapes)| {
            let weighed = |at: usize| shapes[at].0 + cell.shapes[at].log_weight;
            let best = (0..shapes.len()).max_by(|a, b| weighed(*a).total_cmp(&weighed(*b)))?;
            let logs: Vec<f64> = (0..shapes.len()).map(weighed).collect();
            let log_odds = log_sum(&logs) + cell.log_prior;
            let numbers = shapes[best].1.clone();
            let accepted = Accepted {
                cell,
                shape: best,
                numbers,
            };
            Some(Scanned { accepted, log_odds })
        })
        .collect();
    all.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    all
}
