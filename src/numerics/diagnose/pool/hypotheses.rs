//! All hypotheses with their columns, projected off everything that the base model can absorb (Frisch, Waugh, Lovell).
//!
//! A coefficient estimated on the projected residual is the one that a joint fit with all geometry would give, so that the part
//! of an effect that geometry had absorbed comes back in full.

use super::earlier::ListedColumns;
use super::linear::{dot, gram, orthonormal, project, span};
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::Hypothesis;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::ops::{Deref, Range};

/// Hypotheses over one residual.
pub(crate) struct HypothesisSet<'a> {
    pub problem: &'a WhitenedProblem<'a>,
    pub hypotheses: Vec<Hypothesis>,
    /// How many of them are of the list; the others came while it was searched.
    pub listed: usize,
    /// Key of each form: only one of a key is in a set.
    pub keys: Vec<String>,
    pub residual_rows: usize,
    /// Residual rows that say something new: fewer where what is left lasts from row to row.
    pub effective_rows: f64,
    /// Orthonormal basis of what the base model absorbs.
    pub base: Mat<f64>,
    /// Projected residual and its square.
    pub residual: Vec<f64>,
    pub square: f64,
    /// First column of each hypothesis, and the number of columns.
    pub first: Vec<usize>,
    /// Projected columns of unit raw length, one after another.
    columns: Vec<f64>,
    /// Raw length of each column.
    pub scale: Vec<f64>,
    /// Product of each column with the residual.
    pub gradient: Vec<f64>,
    /// Gram matrix of each hypothesis, row by row.
    pub gram: Vec<Vec<f64>>,
    /// -2 ln of the prior of each.
    pub prior_penalty: Vec<f64>,
    /// Whether it is of the torque model, seen only through a compliance in the same set.
    pub of_torque_model: Vec<bool>,
}

/// Columns that one thread projects at once.
const CHUNK: usize = 64;

impl<'a> HypothesisSet<'a> {
    /// `residual` is that of the model without any of the hypotheses; `jacobian` that of the base model. So many rows as
    /// `autocorrelation_time` count as one.
    pub fn new(
        problem: &'a WhitenedProblem<'a>,
        jacobian: &Mat<f64>,
        residual: &[f64],
        autocorrelation_time: f64,
        hypotheses: Vec<Hypothesis>,
    ) -> Self {
        let mut pool = Self::empty(problem, orthonormal(jacobian), residual, autocorrelation_time);
        pool.add(hypotheses);
        pool.listed = pool.hypotheses.len();
        pool
    }

    /// The list of an earlier round, which has the same rows, on another residual.
    pub(super) fn again(
        problem: &'a WhitenedProblem<'a>,
        listed: ListedColumns,
        residual: &[f64],
        autocorrelation_time: f64,
    ) -> Self {
        let ListedColumns { hypotheses, base, columns, scale, first, gram } = listed;
        let mut pool = Self::empty(problem, base, residual, autocorrelation_time);
        (pool.columns, pool.scale, pool.first) = (columns, scale, first);
        for (hypothesis, gram) in hypotheses.into_iter().zip(gram) {
            pool.register(hypothesis, Some(gram));
        }
        pool.listed = pool.hypotheses.len();
        pool
    }

    fn empty(problem: &'a WhitenedProblem<'a>, base: Mat<f64>, residual: &[f64], autocorrelation_time: f64) -> Self {
        let residual_rows = residual.len();
        let mut residual = residual.to_vec();
        project(base.as_ref(), &mut residual);
        let square = dot(&residual, &residual);
        Self {
            problem,
            hypotheses: Vec::new(),
            listed: 0,
            keys: Vec::new(),
            residual_rows,
            effective_rows: residual_rows as f64 / autocorrelation_time,
            base,
            residual,
            square,
            first: vec![0],
            columns: Vec::new(),
            scale: Vec::new(),
            gradient: Vec::new(),
            gram: Vec::new(),
            prior_penalty: Vec::new(),
            of_torque_model: Vec::new(),
        }
    }

    /// Takes a hypothesis whose projected columns, with their raw lengths, are known; returns its position.
    pub(super) fn add_known(&mut self, hypothesis: Hypothesis, (columns, scale): (Vec<f64>, Vec<f64>)) -> usize {
        self.columns.extend(columns);
        self.scale.extend(scale);
        self.first.push(self.scale.len());
        self.register(hypothesis, None);
        self.hypotheses.len() - 1
    }

    /// Columns with their raw lengths.
    pub(super) fn take_columns(&self, own: Range<usize>) -> (Vec<f64>, Vec<f64>) {
        let rows = self.residual_rows;
        (self.columns[own.start * rows..own.end * rows].to_vec(), self.scale[own].to_vec())
    }

    /// The list with its columns.
    pub(super) fn into_columns(mut self) -> ListedColumns {
        let columns = self.first[self.listed];
        self.columns.truncate(columns * self.residual_rows);
        self.scale.truncate(columns);
        self.first.truncate(self.listed + 1);
        self.hypotheses.truncate(self.listed);
        self.gram.truncate(self.listed);
        let Self { hypotheses, base, columns, scale, first, gram, .. } = self;
        ListedColumns { hypotheses, base, columns, scale, first, gram }
    }

    /// Takes more hypotheses; returns the position of the first.
    pub fn add(&mut self, hypotheses: Vec<Hypothesis>) -> usize {
        let begin = self.hypotheses.len();
        let raw: Vec<Vec<f64>> = hypotheses.par_iter().map(|hypothesis| self.problem.columns(&hypothesis.form)).collect();
        let from = self.columns.len();
        let rows = self.residual_rows;
        for columns in raw {
            self.columns.extend(columns);
            self.first.push(self.columns.len() / rows);
        }
        let norms: Vec<Vec<f64>> = self.columns[from..]
            .par_chunks_mut(CHUNK * rows)
            .map(|chunk| {
                let norms = chunk.chunks_mut(rows).map(|column| {
                    let norm = dot(column, column).sqrt();
                    if norm > 0.0 {
                        column.iter_mut().for_each(|value| *value /= norm);
                    }
                    norm
                });
                let norms: Vec<f64> = norms.collect();
                project(self.base.as_ref(), chunk);
                norms
            })
            .collect();
        self.scale.extend(norms.into_iter().flatten());
        hypotheses.into_iter().for_each(|hypothesis| self.register(hypothesis, None));
        begin
    }

    /// Takes the next hypothesis, whose columns are there.
    fn register(&mut self, hypothesis: Hypothesis, known: Option<Vec<f64>>) {
        let (k, rows) = (self.hypotheses.len(), self.residual_rows);
        let own: Vec<&[f64]> = (self.first[k]..self.first[k + 1]).map(|c| &self.columns[c * rows..(c + 1) * rows]).collect();
        self.gradient.extend(own.iter().map(|column| dot(column, &self.residual)));
        self.gram.push(known.unwrap_or_else(|| gram(&own)));
        let places = hypothesis.form.place().count(self.problem.robot.joints()) as f64;
        self.prior_penalty.push(2.0 * hypothesis.tried.ln() + hypothesis.prior_penalty + 2.0 * places.ln());
        self.of_torque_model.push(hypothesis.form.is_of_torque_model());
        self.keys.push(hypothesis.form.key());
        self.hypotheses.push(hypothesis);
    }

    /// How many parameters the base model estimates.
    pub fn rank(&self) -> usize {
        self.base.ncols()
    }

    pub(super) fn column(&self, column: usize) -> &[f64] {
        &self.columns[column * self.residual_rows..(column + 1) * self.residual_rows]
    }

    pub fn all(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.columns, self.residual_rows, self.scale.len())
    }

    pub fn columns_from(&self, h: usize) -> MatRef<'_, f64> {
        self.all().subcols(self.first[h], self.first[h + 1] - self.first[h])
    }

    /// Products of the columns of two hypotheses: those of `a` down, those of `b` across.
    pub fn products(&self, a: usize, b: usize) -> Mat<f64> {
        let (down, across) = (self.columns_from(a), self.columns_from(b));
        let mut products = Mat::zeros(down.ncols(), across.ncols());
        matmul(products.as_mut(), Accum::Replace, down.transpose(), across, 1.0, Par::Seq);
        products
    }

    /// Products of the columns of a hypothesis with those of the pool from `begin` on, for one column of the pool after another.
    pub fn products_with_all(&self, h: usize, begin: usize) -> Vec<f64> {
        let own = self.columns_from(h);
        let mut products = vec![0.0; own.ncols() * (self.scale.len() - begin)];
        products.par_chunks_mut(CHUNK * own.ncols().max(1)).enumerate().for_each(|(chunk, products)| {
            let count = products.len() / own.ncols();
            let some = self.all().subcols(begin + chunk * CHUNK, count);
            let products = MatMut::from_column_major_slice_mut(products, own.ncols(), count);
            matmul(products, Accum::Replace, own.transpose(), some, 1.0, Par::Seq);
        });
        products
    }

    /// Gram matrix of all columns of a set, row by row, from the products of its pairs; the upper triangle of it is empty but for that
    /// of single hypotheses.
    pub fn gram_of<P: Deref<Target = Mat<f64>>>(&self, set: &[usize], products: impl Fn(usize, usize) -> P) -> Vec<f64> {
        let q: usize = set.iter().map(|h| self.first[h + 1] - self.first[*h]).sum();
        let mut gram = vec![0.0; q * q];
        let mut down = 0;
        for (n, a) in set.iter().enumerate() {
            let (rows, mut across) = (self.first[a + 1] - self.first[*a], 0);
            for b in &set[..n] {
                let products = products(*a, *b);
                for i in 0..rows {
                    for j in 0..products.ncols() {
                        gram[(down + i) * q + across + j] = products[(i, j)];
                    }
                }
                across += products.ncols();
            }
            for (i, own) in self.gram[*a].chunks(rows).enumerate() {
                gram[(down + i) * q + across..][..rows].copy_from_slice(own);
            }
            down += rows;
        }
        gram
    }

    /// Columns of all hypotheses of a set.
    pub fn columns_of(&self, set: &[usize]) -> Vec<usize> {
        set.iter().flat_map(|k| self.first[*k]..self.first[*k + 1]).collect()
    }

    /// Orthonormal basis of the columns of a set.
    pub fn span(&self, set: &[usize]) -> Mat<f64> {
        let columns: Vec<&[f64]> = self.columns_of(set).into_iter().map(|column| self.column(column)).collect();
        span(&columns, self.residual_rows)
    }
}
