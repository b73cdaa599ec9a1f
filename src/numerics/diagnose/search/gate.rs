//! Whether what is left holds anything at all: a wild bootstrap of the best hypothesis, one sign a pose.
//!
//! Under each draw the residuals of a pose change sign together, which keeps their size, their correlation within the pose and
//! heavy tails, and destroys every dependence on angles, loads and time (Wu 1986; Cameron, Gelbach and Miller 2008).

use crate::diagnose::pool::{CachedHypotheses, Conditional, dot, project};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

/// Hypotheses that one thread tests, or draws that it projects, at once.
const CHUNK: usize = 32;

/// Draws after which it is seen whether more are needed.
const BLOCK: usize = 32;

/// A probability that no number of draws would show.
const NEVER: f64 = 1e-6;

/// The probability that the best hypothesis of any kind would do as well on noise. `pose[i]` numbers the pose of fitted row i.
pub(super) fn gate(pool: &CachedHypotheses, given: &Conditional, pose: &[usize], draws: usize, seed: u64) -> f64 {
    let rows = pool.residual_rows;
    let basis = pool.span(given.set());
    let mut residual = pool.residual.clone();
    project(basis.as_ref(), &mut residual);
    // Fitted residuals are too small where a row has leverage.
    let leverage = |i: usize| {
        let of = |basis: &Mat<f64>| (0..basis.ncols()).map(|k| basis[(i, k)] * basis[(i, k)]).sum::<f64>();
        (of(&pool.base) + of(&basis)).min(0.99)
    };
    for (i, value) in residual.iter_mut().enumerate() {
        *value /= (1.0 - leverage(i)).sqrt();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let poses = pose.iter().copied().max().map_or(0, |last| last + 1);
    let seen = given.falls.first().map_or(f64::NEG_INFINITY, |(fall, _)| *fall);
    let mut falls: Vec<f64> = Vec::new();
    while falls.len() < draws {
        let count = BLOCK.min(draws - falls.len());
        let mut drawn = Vec::with_capacity(rows * count);
        for _ in 0..count {
            let signs: Vec<f64> = (0..poses).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect();
            drawn.extend(residual.iter().enumerate().map(|(i, value)| value * signs[pose[pool.problem.row_of(i)]]));
        }
        drawn.par_chunks_mut(CHUNK * rows).for_each(|some| {
            project(pool.base.as_ref(), some);
            project(basis.as_ref(), some);
        });
        falls.extend(largest(pool, given, &drawn));
        // One draw as good settles that the gate is closed: more would only say how firmly (Besag and Clifford 1991).
        let as_good = falls.iter().filter(|fall| **fall >= seen).count();
        if as_good > 0 {
            return (1.0 + as_good as f64) / (1.0 + falls.len() as f64);
        }
        if tail(&falls, seen) < NEVER {
            break;
        }
    }
    1.0 / (1.0 + draws as f64)
}

/// The largest fall of the criterion that some hypothesis makes of each drawn residual (columns one after another).
fn largest(pool: &CachedHypotheses, given: &Conditional, drawn: &[f64]) -> Vec<f64> {
    let rows = pool.residual_rows;
    let squares: Vec<f64> = drawn.chunks(rows).map(|column| dot(column, column)).collect();
    let drawn = faer::MatRef::from_column_major_slice(drawn, rows, squares.len());
    let none = || vec![f64::NEG_INFINITY; squares.len()];
    let hypotheses: Vec<usize> = (0..pool.hypotheses.len()).collect();
    let each = hypotheses.par_chunks(CHUNK).map(|some| {
        let (mut best, first) = (none(), pool.first[some[0]]);
        let columns = pool.all().subcols(first, pool.first[some[some.len() - 1] + 1] - first);
        let mut gradients = Mat::zeros(columns.ncols(), squares.len());
        matmul(gradients.as_mut(), Accum::Replace, columns.transpose(), drawn, 1.0, Par::Seq);
        for h in some.iter().filter(|h| given.admits(pool, **h)) {
            let own = gradients.subrows(pool.first[*h] - first, pool.first[h + 1] - pool.first[*h]);
            given.falls_of(pool, *h, own, &squares, |draw, fall| best[draw] = fall.max(best[draw]));
        }
        best
    });
    each.reduce(none, |a, b| a.into_iter().zip(b).map(|(a, b)| a.max(b)).collect())
}

/// The probability of a value as large as `seen` by the largest of many, which these are: Gumbel's law by their mean and scatter
/// (Knijnenburg et al. 2009).
fn tail(largest: &[f64], seen: f64) -> f64 {
    let count = largest.len() as f64;
    let mean = largest.iter().sum::<f64>() / count;
    let variance = largest.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let width = (6.0 * variance).sqrt() / std::f64::consts::PI;
    // Euler's constant: where the mean of Gumbel's law is, in widths.
    let standard = (seen - mean) / width + 0.577_215_664_901_532_9;
    -(-(-standard).exp()).exp_m1()
}
