//! Fedorov's exchange: one pose out, the best of all candidates in, until none helps. Updates are of rank three (Woodbury).
//!
//! Each term is a weighted log determinant over its own seen parameters, in coordinates in which the random candidates are
//! round: determinants change by a constant only, and no digits are lost to ill-scaled parameters.

use super::point_jacobian::{PointJacobian, factor, product};
use super::subset;
use crate::criteria::choose::{PASSES, RIDGE, STEPS, WORTH};
use crate::estimate::factor::{TriangularFactor, axpy};
use crate::estimate::model::Model;
use crate::robot::Measurements;
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use nalgebra::{DMatrix, Matrix3};

/// A weighted log determinant.
pub(super) struct DesignTerm {
    weight: f64,
    jacobian: PointJacobian,
    /// Upper triangular: makes the random candidates round, or what is known before.
    round: Mat<f64>,
    /// Information in every direction before the first pose, in these coordinates.
    ridge: f64,
}

/// What chosen poses make as large as possible.
pub(super) struct Criterion {
    pub(crate) terms: Vec<DesignTerm>,
}

impl DesignTerm {
    /// `None` where the candidates do not tell the parameters.
    pub(crate) fn new(
        weight: f64,
        jacobian: PointJacobian,
        model: &Model,
        drawn: &Measurements,
    ) -> Option<Self> {
        let scale = (drawn.rows() as f64).sqrt();
        let inverse = factor(&jacobian.rows(model, drawn)).inverse()?;
        Some(Self {
            weight,
            jacobian,
            round: inverse.matrix(scale),
            ridge: *RIDGE,
        })
    }

    /// Given what is known before: the factor of its rows. `None` where that leaves a direction free.
    pub(crate) fn given(
        weight: f64,
        jacobian: PointJacobian,
        known: &TriangularFactor,
    ) -> Option<Self> {
        Some(Self {
            weight,
            jacobian,
            round: known.inverse()?.matrix(1.0),
            ridge: 1.0,
        })
    }

    fn state(&self, model: &Model, pool: &Measurements) -> State {
        let rows = product(
            self.jacobian.rows(model, pool).as_ref(),
            self.round.as_ref(),
        );
        let (p, spread) = (self.round.ncols(), vec![[0.0; 6]; pool.rows()]);
        State {
            weight: self.weight,
            p,
            ridge: self.ridge,
            rows,
            cover: Mat::zeros(0, 0),
            spread,
        }
    }
}

/// Inverse information of the poses chosen so far, and what it leaves uncertain at every candidate.
struct State {
    weight: f64,
    p: usize,
    ridge: f64,
    /// A of all candidates, three rows each.
    rows: Mat<f64>,
    /// V, p x p.
    cover: Mat<f64>,
    /// A V A^T of every candidate: xx, yy, zz, xy, xz, yz.
    spread: Vec<[f64; 6]>,
}

/// Entry of a symmetric 3 x 3 matrix in the order of [`State::spread`].
const PLACE: [[usize; 3]; 3] = [[0, 3, 4], [3, 1, 5], [4, 5, 2]];

impl State {
    fn block(&self, candidate: usize) -> MatRef<'_, f64> {
        self.rows.as_ref().subrows(3 * candidate, 3)
    }

    /// V and all spreads anew.
    fn reset(&mut self, chosen: &[usize]) {
        let p = self.p;
        let mut seen = Mat::zeros(3 * chosen.len(), p);
        for (i, candidate) in chosen.iter().enumerate() {
            seen.as_mut()
                .subrows_mut(3 * i, 3)
                .copy_from(self.block(*candidate));
        }
        let mut information = DMatrix::<f64>::identity(p, p) * self.ridge;
        let squares = product(seen.transpose(), seen.as_ref());
        for j in 0..p {
            axpy(
                1.0,
                squares.col_as_slice(j),
                information.column_mut(j).as_mut_slice(),
            );
        }
        // Positive definite by its ridge.
        let cover = information
            .cholesky()
            .map_or_else(|| DMatrix::identity(p, p), |factor| factor.inverse());
        self.cover = Mat::from_fn(p, p, |i, j| cover[(i, j)]);
        let wide = product(self.rows.as_ref(), self.cover.as_ref());
        self.spread.fill([0.0; 6]);
        for j in 0..p {
            let (rows, wide) = (self.rows.col_as_slice(j), wide.col_as_slice(j));
            for (candidate, spread) in self.spread.iter_mut().enumerate() {
                let (a, b) = (
                    &rows[3 * candidate..3 * candidate + 3],
                    &wide[3 * candidate..3 * candidate + 3],
                );
                spread[0] += a[0] * b[0];
                spread[1] += a[1] * b[1];
                spread[2] += a[2] * b[2];
                spread[3] += a[0] * b[1];
                spread[4] += a[0] * b[2];
                spread[5] += a[1] * b[2];
            }
        }
    }

    /// Takes a pose in (`sign` 1) or out (-1).
    fn update(&mut self, candidate: usize, sign: f64) {
        let wide = product(self.cover.as_ref(), self.block(candidate).transpose());
        let seen = Matrix3::from_fn(|a, c| self.spread[candidate][PLACE[a][c]]);
        let Some(small) = (Matrix3::identity() * sign + seen).try_inverse() else {
            return;
        };
        let small = Mat::from_fn(3, 3, |a, c| small[(a, c)]);
        let left = product(wide.as_ref(), small.as_ref());
        matmul(
            &mut self.cover,
            Accum::Add,
            &left,
            wide.transpose(),
            -1.0,
            Par::Seq,
        );
        let across = product(self.rows.as_ref(), wide.as_ref());
        let inside = product(across.as_ref(), small.as_ref());
        let [across, inside] =
            [&across, &inside].map(|m| [m.col_as_slice(0), m.col_as_slice(1), m.col_as_slice(2)]);
        for (other, spread) in self.spread.iter_mut().enumerate() {
            let (x, y, z) = (3 * other, 3 * other + 1, 3 * other + 2);
            let part = |a: usize, c: usize| {
                inside[0][a] * across[0][c]
                    + inside[1][a] * across[1][c]
                    + inside[2][a] * across[2][c]
            };
            spread[0] -= part(x, x);
            spread[1] -= part(y, y);
            spread[2] -= part(z, z);
            spread[3] -= part(x, y);
            spread[4] -= part(x, z);
            spread[5] -= part(y, z);
        }
    }

    /// What the log determinant gains by a pose.
    fn gain(&self, candidate: usize) -> f64 {
        let [x, y, z, xy, xz, yz] = self.spread[candidate];
        let (x, y, z) = (1.0 + x, 1.0 + y, 1.0 + z);
        let determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
        self.weight * determinant.max(f64::MIN_POSITIVE).ln()
    }
}

impl Criterion {
    /// The best poses of those drawn, then of their neighbours (`around`, within a step) until the steps are small.
    pub(crate) fn choose(
        &self,
        model: &Model,
        drawn: &Measurements,
        count: usize,
        mut around: impl FnMut(&Measurements, f64) -> Measurements,
    ) -> Measurements {
        let mut poses = subset(drawn, &self.exchange(model, drawn, &[], count));
        let start: Vec<usize> = (0..count).collect();
        for step in *STEPS {
            let pool = around(&poses, step);
            poses = subset(&pool, &self.exchange(model, &pool, &start, count));
        }
        poses
    }

    /// `count` rows of the pool, from `start` or, where that is shorter, filled up greedily.
    pub(crate) fn exchange(
        &self,
        model: &Model,
        pool: &Measurements,
        start: &[usize],
        count: usize,
    ) -> Vec<usize> {
        let mut states: Vec<State> = self
            .terms
            .iter()
            .map(|term| term.state(model, pool))
            .collect();
        let mut chosen = start.to_vec();
        let mut taken = vec![false; pool.rows()];
        for candidate in &chosen {
            taken[*candidate] = true;
        }
        states.iter_mut().for_each(|state| state.reset(&chosen));
        while chosen.len() < count {
            let Some((best, _)) = best(&states, &taken) else {
                break;
            };
            states.iter_mut().for_each(|state| state.update(best, 1.0));
            taken[best] = true;
            chosen.push(best);
        }
        for _ in 0..*PASSES {
            let mut changed = false;
            for slot in &mut chosen {
                let old = *slot;
                states.iter_mut().for_each(|state| state.update(old, -1.0));
                let stay: f64 = states.iter().map(|state| state.gain(old)).sum();
                let next = best(&states, &taken)
                    .filter(|(_, gain)| *gain > stay + *WORTH)
                    .map_or(old, |(other, _)| other);
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
    let mut found: Option<(usize, f64)> = None;
    for candidate in (0..taken.len()).filter(|candidate| !taken[*candidate]) {
        let gain: f64 = states.iter().map(|state| state.gain(candidate)).sum();
        if gain.is_finite() && found.is_none_or(|(_, most)| gain > most) {
            found = Some((candidate, gain));
        }
    }
    found
}
