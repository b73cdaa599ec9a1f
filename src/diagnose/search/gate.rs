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

/// The gate is closed above this probability that what is left is noise.
pub(crate) const SIGNIFICANT: f64 = 0.004;

/// Hypotheses that one thread tests, or draws that it projects, at once.
const CHUNK: usize = 32;

/// Draws after which it is seen whether more are needed.
const BLOCK: usize = 48;

/// The probability that the best hypothesis of any kind would do as well on noise. `pose[i]` numbers the pose of fitted row i.
pub(super) fn gate(pool: &CachedHypotheses, given: &Conditional, pose: &[usize], draws: usize, seed: u64) -> f64 {
    let rows = pool.residual_rows;
    let mut residual = pool.residual.clone();
    project(given.basis.as_ref(), &mut residual);
    // Fitted residuals are too small where a row has leverage.
    let leverage = |i: usize| {
        let of = |basis: &Mat<f64>| (0..basis.ncols()).map(|k| basis[(i, k)] * basis[(i, k)]).sum::<f64>();
        (of(&pool.base) + of(&given.basis)).min(0.99)
    };
    for (i, value) in residual.iter_mut().enumerate() {
        *value /= (1.0 - leverage(i)).sqrt();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let poses = pose.iter().copied().max().map_or(0, |last| last + 1);
    let seen = given.falls.first().map_or(f64::NEG_INFINITY, |(fall, _)| *fall);
    let hypotheses: Vec<usize> = (0..pool.hypotheses.len()).filter(|h| given.admits(pool, *h)).collect();
    let (mut done, mut as_good) = (0, 0);
    // One draw as good settles that the gate is closed: more would only say how firmly (Besag and Clifford 1991).
    while done < draws && as_good == 0 {
        let count = BLOCK.min(draws - done);
        let mut drawn = Vec::with_capacity(rows * count);
        for _ in 0..count {
            let signs: Vec<f64> = (0..poses).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect();
            drawn.extend(residual.iter().enumerate().map(|(i, value)| value * signs[pose[pool.problem.row_of(i)]]));
        }
        drawn.par_chunks_mut(CHUNK * rows).for_each(|some| {
            project(pool.base.as_ref(), some);
            project(given.basis.as_ref(), some);
        });
        as_good += matching(pool, given, &hypotheses, seen, &drawn, count);
        done += count;
    }
    (1.0 + as_good as f64) / (1.0 + done as f64)
}

/// How many of the drawn residuals (columns one after another) some hypothesis lowers by a fall of the criterion of `seen` or more.
fn matching(pool: &CachedHypotheses, given: &Conditional, hypotheses: &[usize], seen: f64, drawn: &[f64], draws: usize) -> usize {
    let rows = pool.residual_rows;
    let squares: Vec<f64> = drawn.chunks(rows).map(|column| dot(column, column)).collect();
    let drawn = faer::MatRef::from_column_major_slice(drawn, rows, draws);
    let better: Vec<Vec<bool>> = hypotheses
        .par_chunks(CHUNK)
        .map(|some| {
            let mut as_good = vec![false; draws];
            for h in some {
                let columns = pool.columns_from(*h);
                let mut gradients = Mat::zeros(columns.ncols(), draws);
                matmul(gradients.as_mut(), Accum::Replace, columns.transpose(), drawn, 1.0, Par::Seq);
                // The gain that would lower the criterion by as much as what was seen.
                let n = pool.effective_rows;
                let rank = given.gain(pool, *h).1;
                let needed = 1.0 - (-(seen + n.ln() * rank as f64 + pool.prior_penalty[*h]) / n).exp();
                given.gains(pool, *h, &gradients, |draw, gain, rank| {
                    as_good[draw] |= rank > 0 && gain >= needed * squares[draw];
                });
            }
            as_good
        })
        .collect();
    (0..draws).filter(|draw| better.iter().any(|as_good| as_good[*draw])).count()
}
