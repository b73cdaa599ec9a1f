//! All hypotheses with their columns, projected off everything that the base model can absorb (Frisch, Waugh, Lovell).
//!
//! A coefficient estimated on the projected residual is the one that a joint fit with all geometry would give, so that the part
//! of an effect that geometry had absorbed comes back in full.

use super::cholesky::PivotedCholesky;
use super::linear::{dot, gram, orthonormal, project};
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::Hypothesis;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

/// Hypotheses over one residual.
pub(crate) struct HypothesisSet<'a> {
    pub problem: &'a WhitenedProblem<'a>,
    pub hypotheses: Vec<Hypothesis>,
    pub residual_rows: usize,
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
}

/// Columns that one thread projects at once.
const CHUNK: usize = 64;

impl<'a> HypothesisSet<'a> {
    /// `residual` is that of the model without any of the hypotheses; `jacobian` that of the base model.
    pub fn new(problem: &'a WhitenedProblem<'a>, jacobian: &Mat<f64>, residual: &[f64], hypotheses: Vec<Hypothesis>) -> Self {
        let mut pool = Self::empty(problem, orthonormal(jacobian), residual);
        pool.add(hypotheses);
        pool
    }

    fn empty(problem: &'a WhitenedProblem<'a>, base: Mat<f64>, residual: &[f64]) -> Self {
        let residual_rows = residual.len();
        let mut residual = residual.to_vec();
        project(base.as_ref(), &mut residual);
        let square = dot(&residual, &residual);
        Self {
            problem,
            hypotheses: Vec::new(),
            residual_rows,
            base,
            residual,
            square,
            first: vec![0],
            columns: Vec::new(),
            scale: Vec::new(),
            gradient: Vec::new(),
            gram: Vec::new(),
        }
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
        hypotheses.into_iter().for_each(|hypothesis| self.register(hypothesis));
        begin
    }

    /// Takes the next hypothesis, whose columns are there.
    fn register(&mut self, hypothesis: Hypothesis) {
        let (k, rows) = (self.hypotheses.len(), self.residual_rows);
        let own: Vec<&[f64]> = (self.first[k]..self.first[k + 1]).map(|c| &self.columns[c * rows..(c + 1) * rows]).collect();
        self.gradient.extend(own.iter().map(|column| dot(column, &self.residual)));
        self.gram.push(gram(&own));
        self.hypotheses.push(hypothesis);
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

    /// Gram matrix of all columns of a set, row by row; the upper triangle of it is empty but for that
    /// of single hypotheses.
    fn gram_of(&self, set: &[usize]) -> Vec<f64> {
        let q: usize = set.iter().map(|h| self.first[h + 1] - self.first[*h]).sum();
        let mut gram = vec![0.0; q * q];
        let mut down = 0;
        for (n, a) in set.iter().enumerate() {
            let (rows, mut across) = (self.first[a + 1] - self.first[*a], 0);
            for b in &set[..n] {
                let products = self.products(*a, *b);
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

    /// The factor of the Gram matrix of a set's columns.
    pub(super) fn factor(&self, set: &[usize]) -> PivotedCholesky {
        PivotedCholesky::of(self.gram_of(set), self.columns_of(set).len())
    }

    /// Estimates a set of hypotheses together, beside the base model.
    pub fn solve(&self, set: &[usize]) -> Solution {
        solve(self, set, self.factor(set))
    }
}

/// Coefficients of a set of hypotheses.
pub(crate) struct Solution {
    /// By which the squared residual falls.
    pub gain: f64,
    /// How many parameters the data see.
    pub rank: usize,
    /// SI, one for every column of the set.
    pub coefficients: Vec<f64>,
}

/// Estimates a set of hypotheses together, beside the base model, from the factor of their Gram matrix.
fn solve(pool: &HypothesisSet, set: &[usize], factor: PivotedCholesky) -> Solution {
    let columns = pool.columns_of(set);
    let forward = factor.forward(|k| pool.gradient[columns[k]]);
    let gain: f64 = forward.iter().map(|value| value * value).sum();
    let solved = factor.backward(&forward);
    let rank = factor.rank();
    let scale: Vec<f64> = columns.iter().map(|column| pool.scale[*column]).collect();
    let mut coefficients = vec![0.0; columns.len()];
    for (k, value) in factor.order.iter().zip(&solved) {
        coefficients[*k] = value / scale[*k];
    }
    Solution { gain, rank, coefficients }
}
