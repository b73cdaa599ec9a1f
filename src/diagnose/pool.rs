//! All hypotheses with their columns, projected off everything that the base model can absorb (Frisch, Waugh, Lovell).
//!
//! A coefficient estimated on the projected residual is the one that a joint fit with all geometry would give, so that the part
//! of an effect that geometry had absorbed comes back in full.

use super::lens::Lens;
use super::state::State;
use crate::effect::{Effect, Hypothesis};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Hypotheses over one residual. Sets of them are ascending lists of positions.
pub(crate) struct Pool<'a> {
    pub lens: &'a Lens<'a>,
    pub hypotheses: Vec<Hypothesis>,
    /// Key of each form: only one of a key is in a set.
    pub keys: Vec<String>,
    /// Lines of the problem.
    pub lines: usize,
    /// Lines that say something new: fewer where what is left lasts from row to row.
    pub count: f64,
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
    pub charge: Vec<f64>,
    /// Numbers of the torque model, seen only through a compliance in the same set.
    pub borrowed: Vec<bool>,
    products: Mutex<Products>,
    scores: Mutex<HashMap<Vec<usize>, f64>>,
    states: Mutex<HashMap<Vec<usize>, Arc<State>>>,
}

/// Products of the columns of pairs of hypotheses.
type Products = HashMap<(usize, usize), Arc<Mat<f64>>>;

/// Columns that one thread projects at once.
const CHUNK: usize = 64;
/// A group may have at most one number for so many lines.
pub(crate) const LINES_EACH: usize = 4;

impl<'a> Pool<'a> {
    /// `residual` is that of the model without any of the hypotheses; `jacobian` that of the base model.
    pub fn new(lens: &'a Lens<'a>, jacobian: &Mat<f64>, residual: &[f64], hypotheses: Vec<Hypothesis>) -> Self {
        let lines = residual.len();
        let base = orthonormal(jacobian);
        let mut residual = residual.to_vec();
        project(base.as_ref(), &mut residual);
        let square = dot(&residual, &residual);
        let mut pool = Self {
            lens,
            hypotheses: Vec::new(),
            keys: Vec::new(),
            lines,
            count: lines as f64,
            base,
            residual,
            square,
            first: vec![0],
            columns: Vec::new(),
            scale: Vec::new(),
            gradient: Vec::new(),
            gram: Vec::new(),
            charge: Vec::new(),
            borrowed: Vec::new(),
            products: Mutex::default(),
            scores: Mutex::default(),
            states: Mutex::default(),
        };
        pool.add(hypotheses);
        pool
    }

    /// The same where so many rows in a row count as one.
    pub fn with_alike(self, rows: f64) -> Self {
        Self { count: self.lines as f64 / rows, ..self }
    }

    /// Takes more hypotheses; returns the position of the first.
    pub fn add(&mut self, hypotheses: Vec<Hypothesis>) -> usize {
        let begin = self.hypotheses.len();
        let raw: Vec<Vec<f64>> = hypotheses.par_iter().map(|hypothesis| self.lens.columns(&hypothesis.form)).collect();
        let from = self.columns.len();
        for columns in raw {
            self.columns.extend(columns);
            self.first.push(self.columns.len() / self.lines);
        }
        let lines = self.lines;
        let norms: Vec<Vec<f64>> = self.columns[from..]
            .par_chunks_mut(CHUNK * lines)
            .map(|chunk| {
                let norms = chunk.chunks_mut(lines).map(|column| {
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
        let joints = self.lens.robot.joints();
        for hypothesis in hypotheses {
            let k = self.hypotheses.len();
            let own: Vec<&[f64]> =
                (self.first[k]..self.first[k + 1]).map(|c| &self.columns[c * lines..(c + 1) * lines]).collect();
            self.gradient.extend(own.iter().map(|column| dot(column, &self.residual)));
            self.gram.push(gram(&own));
            let places = hypothesis.form.place().count(joints) as f64;
            self.charge.push(2.0 * hypothesis.tried.ln() + hypothesis.charge + 2.0 * places.ln());
            self.borrowed.push(hypothesis.form.is_of_torque_model());
            self.keys.push(hypothesis.form.key());
            self.hypotheses.push(hypothesis);
        }
        lock(&self.states).clear();
        begin
    }

    /// How many numbers the base model estimates.
    pub fn rank(&self) -> usize {
        self.base.ncols()
    }

    pub fn column(&self, column: usize) -> &[f64] {
        &self.columns[column * self.lines..(column + 1) * self.lines]
    }

    pub fn all(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.columns, self.lines, self.scale.len())
    }

    fn columns_from(&self, h: usize) -> MatRef<'_, f64> {
        self.all().subcols(self.first[h], self.first[h + 1] - self.first[h])
    }

    /// Products of the columns of two hypotheses: those of `a` down, those of `b` across. Sets share most of their pairs.
    fn products(&self, a: usize, b: usize) -> Arc<Mat<f64>> {
        if let Some(products) = lock(&self.products).get(&(a, b)) {
            return products.clone();
        }
        let (down, across) = (self.columns_from(a), self.columns_from(b));
        let mut products = Mat::zeros(down.ncols(), across.ncols());
        matmul(products.as_mut(), Accum::Replace, down.transpose(), across, 1.0, Par::Seq);
        let products = Arc::new(products);
        lock(&self.products).insert((a, b), products.clone());
        products
    }

    /// Gram matrix of all columns of a set, row by row; the upper triangle of it is empty but for that of single hypotheses.
    pub fn gram_of(&self, set: &[usize]) -> Vec<f64> {
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

    /// The problem with the hypotheses of a set estimated beside the base model.
    pub fn state(&self, set: &[usize]) -> Arc<State> {
        if let Some(state) = lock(&self.states).get(set) {
            return state.clone();
        }
        let state = Arc::new(State::of(self, set));
        lock(&self.states).insert(set.to_vec(), state.clone());
        state
    }

    /// Drops remembered states but those of `keep`.
    pub fn forget(&self, keep: &[Vec<usize>]) {
        lock(&self.states).retain(|set, _| set.is_empty() || keep.contains(set));
    }

    /// Whether all members of a set make sense together.
    fn is_sound(&self, set: &[usize]) -> bool {
        let yields = |k: &usize| matches!(self.hypotheses[*k].form.name(), "joint_compliance" | "joint_hardening");
        !set.iter().any(|k| self.borrowed[*k]) || set.iter().any(yields)
    }

    /// Bayesian information criterion of a set with the prior's charges; implausible signs and sizes are charged too.
    pub fn bic(&self, set: &[usize]) -> f64 {
        if let Some(score) = lock(&self.scores).get(set) {
            return *score;
        }
        let score = if self.is_sound(set) {
            let solution = super::state::solve(self, set);
            let n = self.count;
            let rest = (self.square - solution.gain).max(1e-300);
            let charges: f64 = set.iter().map(|k| self.charge[*k]).sum();
            n * (rest / n).ln() + n.ln() * solution.rank as f64 + charges + self.sign_charge(set, &solution)
        } else {
            f64::INFINITY
        };
        lock(&self.scores).insert(set.to_vec(), score);
        score
    }

    /// Charge for every coefficient that has the wrong sign or is too large, by more than two standard errors.
    fn sign_charge(&self, set: &[usize], solution: &super::state::Solution) -> f64 {
        let columns = set.iter().flat_map(|k| (self.first[*k]..self.first[*k + 1]).map(move |_| *k));
        let wrong = columns.zip(solution.coefficients.iter().zip(&solution.errors)).filter(|(k, (value, error))| {
            let Hypothesis { positive, largest, .. } = &self.hypotheses[*k];
            (*positive && **value < -2.0 * **error) || value.abs() - 2.0 * **error > *largest
        });
        IMPLAUSIBLE * wrong.count() as f64
    }
}

/// Remembered results stay right whoever panicked.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// -2 ln of the odds of a sign or size that physics forbids.
const IMPLAUSIBLE: f64 = 40.0;

/// An orthonormal basis of the columns of `matrix`, which are scaled to unit length first.
pub(crate) fn orthonormal(matrix: &Mat<f64>) -> Mat<f64> {
    let norm = |j: usize| matrix.col(j).norm_l2().max(1e-300);
    let scale: Vec<f64> = (0..matrix.ncols()).map(norm).collect();
    let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / scale[j]);
    scaled.qr().compute_thin_Q()
}

/// Removes from columns (one after another) what lies in the span of an orthonormal basis.
pub(crate) fn project(basis: MatRef<'_, f64>, columns: &mut [f64]) {
    let lines = basis.nrows();
    let count = columns.len() / lines.max(1);
    if basis.ncols() == 0 || count == 0 {
        return;
    }
    let mut share = Mat::zeros(basis.ncols(), count);
    let mut columns = MatMut::from_column_major_slice_mut(columns, lines, count);
    matmul(share.as_mut(), Accum::Replace, basis.transpose(), columns.as_ref(), 1.0, Par::Seq);
    matmul(columns.as_mut(), Accum::Add, basis, share.as_ref(), -1.0, Par::Seq);
}

/// Gram matrix of some columns, row by row.
pub(crate) fn gram(columns: &[&[f64]]) -> Vec<f64> {
    let q = columns.len();
    let mut gram = vec![0.0; q * q];
    for i in 0..q {
        for j in 0..=i {
            gram[i * q + j] = dot(columns[i], columns[j]);
            gram[j * q + i] = gram[i * q + j];
        }
    }
    gram
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums: the compiler may not reorder one.
    let (mut sums, chunks) = ([0.0; 4], a.len() / 4);
    for k in 0..chunks {
        for lane in 0..4 {
            sums[lane] += a[4 * k + lane] * b[4 * k + lane];
        }
    }
    let tail: f64 = (4 * chunks..a.len()).map(|k| a[k] * b[k]).sum();
    sums[0] + sums[1] + sums[2] + sums[3] + tail
}
