//! Cross-validation: every fitted row predicted by a fit that has not seen its pose, in folds drawn at random and in contiguous
//! blocks. Rows of one pose stay together: a pose that was seen is no test; of a moving arm stretches of rows do.
//!
//! A fold's fit is the whole one less the fold's rows, one Gauss-Newton step away: of G = J R^-1 of these rows (R'R = J'J of all) and
//! their errors e it is R^-1 (1 - G'G)^-1 (Q'r - G'e). Where that step is not small, the fit is repeated instead.

use super::factor::TriangularFactor;
use super::fit::{FitOptions, Fitted, ParameterStatus, fit};
use super::model::Model;
use super::problem::Problem;
use super::repeats::Poses;
use super::row_error::row_error;
use super::session::Session;
use super::term::ObservationTerm;
use crate::observation::KINDS;
use crate::robot::Measurements;
use faer::Mat;
use nalgebra::{DMatrix, DVector, Vector3};
use rand::SeedableRng;
use rand::rngs::ChaCha8Rng;
use rand::seq::SliceRandom;
use rayon::prelude::*;

/// Least share of what is known in any direction that must be left without a fold: with less, other parameters may be seen.
const LEFT: f64 = 0.02;
/// Stretches into which the recording of a moving arm is cut.
const STRETCHES: usize = 40;
/// Departure from a straight line (of the fold's errors) up to which a step is small.
const STRAIGHT: f64 = 0.01;

/// Errors (m) of rows under fits without them, in the order of the fitted rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Folds {
    pub count: usize,
    /// Folds drawn at random: new poses among those that were measured.
    pub random: Vec<f64>,
    /// Contiguous stretches of the recording: poses of another time and, often, another region.
    pub blocks: Vec<f64>,
}

/// Takes `2 * count` parts of its rows off a fit, each in turn. `None` where the poses are too few for it.
///
/// What the whole fit saw is estimated; which rows were set aside is taken over.
pub fn cross_validate(whole: &Session, count: usize, seed: u64) -> Option<Folds> {
    let Session { data, rows, .. } = *whole;
    let parts = parts(data, rows);
    let order = whole.divisible(&parts, count)?;
    let blocks = deal(&order, rows.len(), count);
    let random = at_random(order, rows.len(), count, seed);
    let folds: Vec<&Vec<usize>> = random.iter().chain(&blocks).collect();
    let errors = whole.without_each(&folds);
    let (one, other) = errors.split_at(count);
    Some(Folds { count, random: gather(data, rows, &random, one), blocks: gather(data, rows, &blocks, other) })
}

/// How rows are dealt into folds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FoldKind {
    /// As [`Folds::random`], drawn with a seed.
    Random(u64),
    /// As [`Folds::blocks`].
    Blocks,
}

/// One kind of [`Folds`] alone.
pub(crate) fn folds_of(kind: FoldKind, whole: &Session, count: usize) -> Option<Vec<f64>> {
    let Session { data, rows, .. } = *whole;
    let parts = parts(data, rows);
    let order = whole.divisible(&parts, count)?;
    let folds = match kind {
        FoldKind::Random(seed) => at_random(order, rows.len(), count, seed),
        FoldKind::Blocks => deal(&order, rows.len(), count),
    };
    let errors = whole.without_each(&folds.iter().collect::<Vec<_>>());
    Some(gather(data, rows, &folds, &errors))
}

/// Poses dealt in an order that `seed` draws.
fn at_random(mut order: Vec<&Vec<usize>>, rows: usize, count: usize, seed: u64) -> Vec<Vec<usize>> {
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    deal(&order, rows, count)
}

impl Session<'_> {
    fn candidates(&self) -> Vec<usize> {
        let estimated = |k: &usize| matches!(self.fitted.statuses[*k], ParameterStatus::Free(_) | ParameterStatus::Bound(_));
        (0..self.fitted.statuses.len()).filter(estimated).collect()
    }

    /// The parts in their order, where they are enough for so many folds.
    fn divisible<'p>(&self, parts: &'p [Vec<usize>], count: usize) -> Option<Vec<&'p Vec<usize>>> {
        let left = (self.rows.len() * (count.max(1) - 1)) / count.max(1);
        let enough = count >= 2 && parts.len() >= 2 * count && 3 * left > self.candidates().len();
        enough.then(|| parts.iter().collect())
    }

    /// Errors (m) of the rows of each fold under a fit to the others.
    fn without_each(&self, folds: &[&Vec<usize>]) -> Vec<Vec<f64>> {
        let Self { model, data, rows, fitted } = *self;
        let candidates = self.candidates();
        let problem = Problem { data, rows, excess: fitted.excess() };
        let near = Near::of(&problem, model, fitted);
        let one = |fold: &&Vec<usize>| {
            let close = near.as_ref().and_then(|near| near.without(&problem, model, fold));
            close.unwrap_or_else(|| without(model, data, rows, &candidates, fold))
        };
        folds.par_iter().map(one).collect()
    }
}

/// Rows that belong together, in the order of recording: those of one pose; of a moving arm, whose neighbouring rows know each other,
/// stretches of rows.
fn parts(data: &Measurements, rows: &[usize]) -> Vec<Vec<usize>> {
    if !data.in_motion(rows) {
        return Poses::of(data, rows).all().to_vec();
    }
    rows.chunks(rows.len().div_ceil(STRETCHES).max(1)).map(<[usize]>::to_vec).collect()
}

/// Rows of each fold, sorted: poses in the given order, about as many rows in each.
fn deal(poses: &[&Vec<usize>], rows: usize, count: usize) -> Vec<Vec<usize>> {
    let mut folds = vec![Vec::new(); count];
    let mut dealt = 0;
    for pose in poses {
        // A pose belongs to the fold in which its middle lies.
        let middle = 2 * dealt + pose.len();
        let fold = (middle * count / (2 * rows.max(1))).min(count - 1);
        folds[fold].extend_from_slice(pose);
        dealt += pose.len();
    }
    for fold in &mut folds {
        fold.sort_unstable();
    }
    folds
}

/// The problem at the whole fit's solution.
struct Near {
    free: Vec<usize>,
    factor: TriangularFactor,
    inverse: Mat<f64>,
}

impl Near {
    /// `None` where bounds are in the way or the factor is singular.
    fn of(problem: &Problem, model: &Model, fitted: &Fitted) -> Option<Self> {
        if model.known.values().any(|known| known.bounds.is_some()) {
            return None;
        }
        let free: Vec<usize> =
            (0..fitted.statuses.len()).filter(|k| matches!(fitted.statuses[*k], ParameterStatus::Free(_))).collect();
        let factor = problem.evaluate(model, &free).factor;
        let inverse = factor.inverse()?;
        let inverse = Mat::from_fn(free.len(), free.len(), |i, j| inverse.at(i, j));
        Some(Self { free, factor, inverse })
    }

    /// Errors of the rows `part` under a fit to the others. `None` where that is farther than a small step.
    fn without(&self, problem: &Problem, model: &Model, part: &[usize]) -> Option<Vec<f64>> {
        let p = self.free.len();
        let (jacobian, errors, shares) = self.linear(problem, model, part);
        let seen = &jacobian * &self.inverse;
        let taken = seen.transpose() * &seen;
        let left = DMatrix::from_fn(p, p, |i, j| f64::from(u8::from(i == j)) - taken[(i, j)]);
        let factor = left.cholesky()?;
        if factor.l_dirty().diagonal().iter().any(|pivot| pivot * pivot < LEFT) {
            return None;
        }
        let gradient = |j: usize| errors.iter().zip(seen.col_as_slice(j)).map(|(error, seen)| error * seen).sum::<f64>();
        let along = factor.solve(&DVector::from_fn(p, |j, _| self.factor.entry(j, p) - gradient(j)));
        let mut other = model.clone();
        for (i, parameter) in self.free.iter().enumerate() {
            other.x[*parameter] += (i..p).map(|j| self.inverse[(i, j)] * along[j]).sum::<f64>();
        }
        let mut scratch = other.stack.scratch(&other.robot);
        let after = part.iter().flat_map(|row| {
            let placed = other.place(problem.data, *row, &mut scratch);
            let terms = KINDS.iter().filter_map(|kind| ObservationTerm::of(*kind, problem.data, *row, &placed, problem.excess));
            terms.map(|(term, _)| term.error).collect::<Vec<_>>()
        });
        let after: Vec<f64> = after.zip(&shares).flat_map(|(error, share)| <[f64; 3]>::from(error * *share)).collect();
        let (mut bend, mut whole) = (0.0, 0.0);
        for (i, (before, after)) in errors.iter().zip(&after).enumerate() {
            let straight = before - (0..p).map(|j| seen[(i, j)] * along[j]).sum::<f64>();
            whole += straight * straight;
            bend += (after - straight).powi(2);
        }
        if bend > STRAIGHT * STRAIGHT * whole {
            return None;
        }
        Some(part.iter().map(|row| row_error(&other, problem.data, *row, &mut scratch).length).collect())
    }

    /// Whitened derivatives and errors of the terms of some rows, three lines each, and the root of each one's Huber weight.
    fn linear(&self, problem: &Problem, model: &Model, part: &[usize]) -> (Mat<f64>, Vec<f64>, Vec<f64>) {
        let p = self.free.len();
        let mut column = vec![usize::MAX; model.stack.specs().len()];
        for (j, parameter) in self.free.iter().enumerate() {
            column[*parameter] = j;
        }
        let mut scratch = model.stack.scratch(&model.robot);
        let (mut lines, mut errors, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        for row in part {
            let mut placed = model.place(problem.data, *row, &mut scratch);
            for kind in KINDS {
                let Some((term, _)) = ObservationTerm::of(*kind, problem.data, *row, &placed, problem.excess) else { continue };
                let share = term.share();
                let mut line = vec![Vector3::zeros(); p];
                term.derivatives(&mut placed, |parameter, derivative| {
                    if let Some(sum) = line.get_mut(column[parameter]) {
                        *sum += derivative * share;
                    }
                });
                lines.push(line);
                errors.extend(<[f64; 3]>::from(term.error * share));
                shares.push(share);
            }
        }
        let mut jacobian = Mat::zeros(errors.len(), p);
        for j in 0..p {
            for (to, line) in jacobian.col_as_slice_mut(j).chunks_exact_mut(3).zip(&lines) {
                to.copy_from_slice(line[j].as_slice());
            }
        }
        (jacobian, errors, shares)
    }
}

/// Errors of the rows `part` under a fit to the others.
fn without(model: &Model, data: &Measurements, rows: &[usize], candidates: &[usize], part: &[usize]) -> Vec<f64> {
    let kept: Vec<usize> = rows.iter().copied().filter(|row| part.binary_search(row).is_err()).collect();
    let (other, _) = fit(model, data, &FitOptions { rows: &kept, candidates });
    let mut scratch = other.stack.scratch(&other.robot);
    part.iter().map(|row| row_error(&other, data, *row, &mut scratch).length).collect()
}

fn gather(data: &Measurements, rows: &[usize], parts: &[Vec<usize>], errors: &[Vec<f64>]) -> Vec<f64> {
    let mut all = vec![f64::NAN; data.rows()];
    for (row, error) in parts.iter().flatten().zip(errors.iter().flatten()) {
        all[*row] = *error;
    }
    rows.iter().map(|row| all[*row]).collect()
}
