//! Fedorov's exchange: one pose out, the best of all candidates in, until none helps. Updates are of rank three (Woodbury).
//!
//! Each term is a weighted log determinant over its own seen parameters, in coordinates in which the random candidates are
//! round: determinants change by a constant only, and no digits are lost to ill-scaled parameters.

use super::sight::Sight;
use crate::estimate::model::Model;
use crate::robot::Measurements;
use faer::Mat;
use nalgebra::{DMatrix, Matrix3};
use rayon::prelude::*;

/// Information in every direction before the first pose, in units of an average candidate's: makes the first steps defined.
const RIDGE: f64 = 1e-3;
/// Passes over all chosen poses; later ones gain next to nothing.
const PASSES: usize = 4;
/// Gain of log determinant that is worth an exchange.
const WORTH: f64 = 1e-6;

/// A weighted log determinant.
pub(super) struct Term {
    weight: f64,
    sight: Sight,
    /// Upper triangular: makes the random candidates round.
    round: Mat<f64>,
}

/// What chosen poses make as large as possible.
pub(super) struct Criterion {
    pub terms: Vec<Term>,
}

impl Term {
    /// `None` where the candidates do not tell the parameters.
    pub fn new(weight: f64, sight: Sight, model: &Model, drawn: &Measurements) -> Option<Self> {
        let scale = (drawn.rows() as f64).sqrt();
        let inverse = sight.factor(model, drawn).inverse()?;
        let round = Mat::from_fn(inverse.nrows(), inverse.ncols(), |i, j| inverse[(i, j)] * scale);
        Some(Self { weight, sight, round })
    }

    fn state(&self, model: &Model, pool: &Measurements) -> State {
        let p = self.sight.free().len();
        let mut rows = self.sight.rows(model, pool);
        rows.par_chunks_mut(p.max(1)).with_min_len(256).for_each(|row| {
            // Upper triangular and from the right: in place.
            for j in (0..p).rev() {
                row[j] = (0..=j).map(|i| row[i] * self.round[(i, j)]).sum();
            }
        });
        State { weight: self.weight, p, rows, cover: Vec::new(), spread: vec![Matrix3::zeros(); pool.rows()] }
    }
}

/// Inverse information of the poses chosen so far, and what it leaves uncertain at every candidate.
struct State {
    weight: f64,
    p: usize,
    rows: Vec<f64>,
    /// V, p x p.
    cover: Vec<f64>,
    /// A V A^T of every candidate.
    spread: Vec<Matrix3<f64>>,
}

impl State {
    fn block(&self, candidate: usize) -> &[f64] {
        &self.rows[3 * self.p * candidate..3 * self.p * (candidate + 1)]
    }

    /// V and all spreads anew.
    fn reset(&mut self, chosen: &[usize]) {
        let p = self.p;
        let mut information = DMatrix::<f64>::identity(p, p) * RIDGE;
        for candidate in chosen {
            let block = DMatrix::from_row_slice(3, p, self.block(*candidate));
            information += block.transpose() * &block;
        }
        // Positive definite by its ridge.
        let cover = information.cholesky().map_or_else(|| DMatrix::identity(p, p), |factor| factor.inverse());
        self.cover = cover.as_slice().to_vec();
        let (rows, cover) = (&self.rows, &self.cover);
        self.spread.par_iter_mut().enumerate().with_min_len(64).for_each(|(candidate, spread)| {
            let block = &rows[3 * p * candidate..3 * p * (candidate + 1)];
            *spread = product(block, &times(cover, block, p), p);
        });
    }

    /// Takes a pose in (`sign` 1) or out (-1).
    fn update(&mut self, candidate: usize, sign: f64) {
        let p = self.p;
        let wide = times(&self.cover, self.block(candidate), p);
        let Some(small) = (Matrix3::identity() * sign + self.spread[candidate]).try_inverse() else { return };
        for i in 0..p {
            let left: [f64; 3] = [0, 1, 2].map(|c| (0..3).map(|a| wide[a * p + i] * small[(a, c)]).sum::<f64>());
            for j in 0..p {
                self.cover[i * p + j] -= left[0] * wide[j] + left[1] * wide[p + j] + left[2] * wide[2 * p + j];
            }
        }
        let rows = &self.rows;
        self.spread.par_iter_mut().enumerate().with_min_len(256).for_each(|(other, spread)| {
            let across = product(&rows[3 * p * other..3 * p * (other + 1)], &wide, p);
            *spread -= across * small * across.transpose();
        });
    }

    /// What the log determinant gains by a pose.
    fn gain(&self, candidate: usize) -> f64 {
        self.weight * (Matrix3::identity() + self.spread[candidate]).determinant().max(f64::MIN_POSITIVE).ln()
    }
}

/// V A^T as three vectors.
fn times(cover: &[f64], block: &[f64], p: usize) -> Vec<f64> {
    let mut out = vec![0.0; 3 * p];
    for (axis, row) in block.chunks_exact(p).enumerate() {
        for (value, line) in out[axis * p..(axis + 1) * p].iter_mut().zip(cover.chunks_exact(p)) {
            *value = dot(line, row);
        }
    }
    out
}

/// A W for three rows and three vectors.
fn product(block: &[f64], wide: &[f64], p: usize) -> Matrix3<f64> {
    Matrix3::from_fn(|a, c| dot(&block[a * p..(a + 1) * p], &wide[c * p..(c + 1) * p]))
}

/// Four sums at once: three times as fast, and in a fixed order.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (left, right) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = left.remainder().iter().zip(right.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in left.zip(right) {
        for lane in 0..4 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

impl Criterion {
    /// `count` rows of the pool, from `start` or, where that is shorter, filled up greedily.
    pub fn exchange(&self, model: &Model, pool: &Measurements, start: &[usize], count: usize) -> Vec<usize> {
        let mut states: Vec<State> = self.terms.iter().map(|term| term.state(model, pool)).collect();
        let mut chosen = start.to_vec();
        let mut taken = vec![false; pool.rows()];
        for candidate in &chosen {
            taken[*candidate] = true;
        }
        states.iter_mut().for_each(|state| state.reset(&chosen));
        while chosen.len() < count {
            let Some((best, _)) = best(&states, &taken) else { break };
            states.iter_mut().for_each(|state| state.update(best, 1.0));
            taken[best] = true;
            chosen.push(best);
        }
        for _ in 0..PASSES {
            let mut changed = false;
            for slot in &mut chosen {
                let old = *slot;
                states.iter_mut().for_each(|state| state.update(old, -1.0));
                let stay: f64 = states.iter().map(|state| state.gain(old)).sum();
                let next = best(&states, &taken).filter(|(_, gain)| *gain > stay + WORTH).map_or(old, |(other, _)| other);
                if next != old {
                    (taken[old], taken[next]) = (false, true);
                    *slot = next;
                    changed = true;
                }
                states.iter_mut().for_each(|state| state.update(next, 1.0));
            }
            if !changed {
                break;
            }
            // Rounding of many updates does not add up.
            states.iter_mut().for_each(|state| state.reset(&chosen));
        }
        chosen
    }
}

/// The free candidate of most gain; the first of equals.
fn best(states: &[State], taken: &[bool]) -> Option<(usize, f64)> {
    let gains: Vec<f64> = (0..taken.len())
        .into_par_iter()
        .with_min_len(256)
        .map(
            |candidate| if taken[candidate] { f64::NEG_INFINITY } else { states.iter().map(|state| state.gain(candidate)).sum() },
        )
        .collect();
    let mut found: Option<(usize, f64)> = None;
    for (candidate, gain) in gains.into_iter().enumerate() {
        if gain.is_finite() && found.is_none_or(|(_, most)| gain > most) {
            found = Some((candidate, gain));
        }
    }
    found
}
