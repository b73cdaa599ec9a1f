//! Linear corrections fitted with as many priors as groups of terms, each sized by the evidence (MacKay 1992).
//!
//! With `H = A^T W A`, coefficients are `beta C A^T W b`, `C = (beta H + diag alpha)^-1`; a group of `m` terms has
//! `gamma = m - alpha tr C` well-determined ones and takes `alpha = gamma / |x|^2`. Rows far off count less (Huber). The matrix is
//! summed in chunks of rows, so memory does not grow with the recording.

use super::arm::ScrewArm;
use super::basis::{BasisFunctions, BasisTerm};
use super::perceptron::scatter;
use super::region::TrainingSamples;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::solvers::{Llt, Solve};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Accum, Mat, Par, Side};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Rows that are fitted at most, evenly spread: more say little new and cost time.
const ROWS: usize = 4000;
/// Rows whose columns are in memory at once.
const CHUNK: usize = 128;
/// Rounds of weights, and of priors within each.
const ROUNDS: usize = 2;
const PRIORS: usize = 4;
/// Rows so many sigmas off begin to count less.
const HUBER: f64 = 3.0;
/// Draws from the posterior that tell the spread.
pub(crate) const DRAWS: usize = 8;

/// Terms and their coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Linear {
    /// For terms that move joints.
    pub arm: Option<ScrewArm>,
    /// What is summed.
    pub terms: Vec<BasisTerm>,
    /// The most likely coefficients, then `DRAWS` draws from the posterior.
    pub members: Vec<Vec<f64>>,
    /// What is left per axis, m.
    pub noise: f64,
}

impl Linear {
    /// Fits `groups` of terms. `None` where nothing moves or the matrix is singular.
    pub fn fit(
        samples: &TrainingSamples,
        arm: Option<&ScrewArm>,
        groups: &[Vec<BasisTerm>],
        seed: u64,
    ) -> Option<Self> {
        let every = samples.rows().div_ceil(ROWS).max(1);
        let rows: Vec<usize> = (0..samples.rows()).step_by(every).collect();
        let mut sums = Sums::new(samples, &rows, arm, groups)?;
        let group = sums.group.clone();
        let p = group.len();
        let count = |g| group.iter().filter(|group_of| **group_of == g).count() as f64;
        let counts: Vec<f64> = (0..groups.len()).map(count).collect();
        // In units of the residual: each column starts as a tenth of it, and half of it as noise.
        let (mut alpha, mut beta) = (vec![100.0; groups.len()], 4.0);
        let mut weights = vec![1.0; rows.len()];
        let mut x = vec![0.0; p];
        let mut factor = None;
        for _ in 0..ROUNDS {
            sums.add_up(&weights);
            for _ in 0..PRIORS {
                let posterior = Mat::from_fn(p, p, |i, j| {
                    beta * sums.h[(i, j)] + if i == j { alpha[group[i]] } else { 0.0 }
                });
                let llt = Llt::new(posterior.as_ref(), Side::Lower).ok()?;
                let right = Mat::from_fn(p, 1, |i, _| beta * sums.g[i]);
                x = llt.solve(&right).col_as_slice(0).to_vec();
                let variances = variances(&llt);
                let mut determined = 0.0;
                for (g, alpha) in alpha.iter_mut().enumerate() {
                    let terms = (0..p).filter(|i| group[*i] == g);
                    let (trace, squares) = terms.fold((0.0, 0.0), |sum, i| {
                        (sum.0 + variances[i], sum.1 + x[i] * x[i])
                    });
                    let gamma = (counts[g] - *alpha * trace).clamp(1e-3, counts[g].max(1e-3));
                    determined += gamma;
                    *alpha = (gamma / squares.max(1e-12)).clamp(1e-2, 1e10);
                }
                let left = sums.misfit(&x).max(1e-12);
                beta = ((sums.count - determined).max(1.0) / left).clamp(1e-3, 1e12);
                factor = Some(llt);
            }
            weights = sums.weights(&x, HUBER * 3.0_f64.sqrt() / beta.sqrt());
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draws = Mat::from_fn(p, DRAWS, |_, _| normal(&mut rng));
        solve_upper_triangular_in_place(factor?.L().transpose(), draws.as_mut(), Par::Seq);
        let unit = sums.unit;
        let scaled = |i: usize, value: f64| value * unit / sums.scale[i];
        let mut members = vec![(0..p).map(|i| scaled(i, x[i])).collect()];
        members
            .extend((0..DRAWS).map(|d| (0..p).map(|i| scaled(i, x[i] + draws[(i, d)])).collect()));
        Some(Self {
            arm: arm.cloned(),
            terms: sums.terms,
            members,
            noise: unit / beta.sqrt(),
        })
    }

    /// The correction and its standard deviation per axis beside the noise, m.
    pub(crate) fn at(&self, q: &[f64]) -> ([f64; 3], f64) {
        let mut sums = vec![[0.0; 3]; self.members.len()];
        BasisFunctions::new(self.arm.as_ref(), &self.terms).at(q, |t, way| {
            for (sum, member) in sums.iter_mut().zip(&self.members) {
                for (sum, value) in sum.iter_mut().zip(way) {
                    *sum += member[t] * value;
                }
            }
        });
        let Some((mean, draws)) = sums.split_first() else {
            return ([0.0; 3], 0.0);
        };
        (*mean, scatter(draws, mean))
    }
}

/// The normal equations of scaled columns and of the residual in units of its root mean square.
struct Sums<'a> {
    samples: &'a TrainingSamples,
    rows: &'a [usize],
    arm: Option<&'a ScrewArm>,
    /// Those that move the point anywhere, the root mean square of each, and its group.
    terms: Vec<BasisTerm>,
    scale: Vec<f64>,
    group: Vec<usize>,
    /// Root mean square of the residual, m.
    unit: f64,
    h: Mat<f64>,
    g: Vec<f64>,
    /// Weighted sum of squared residuals, and of values.
    squares: f64,
    count: f64,
}

impl<'a> Sums<'a> {
    /// `None` where nothing moves.
    fn new(
        samples: &'a TrainingSamples,
        rows: &'a [usize],
        arm: Option<&'a ScrewArm>,
        groups: &[Vec<BasisTerm>],
    ) -> Option<Self> {
        let all: Vec<BasisTerm> = groups.iter().flatten().cloned().collect();
        let mut squares = vec![0.0; all.len()];
        let mut basis = BasisFunctions::new(arm, &all);
        for row in rows {
            basis.at(&samples.sources[*row], |t, way| {
                squares[t] += way.iter().map(|v| v * v).sum::<f64>()
            });
        }
        let root_mean = |sum: f64| (sum / (3 * rows.len().max(1)) as f64).sqrt();
        let (mut terms, mut scale, mut group) = (Vec::new(), Vec::new(), Vec::new());
        let groups = groups.iter().enumerate();
        let group_of = groups.flat_map(|(g, terms)| terms.iter().map(move |_| g));
        for ((term, g), sum) in all.into_iter().zip(group_of).zip(squares) {
            let size = root_mean(sum);
            // A metre of lever arm times a hundredth of a microradian is nothing.
            if size > 1e-8 {
                terms.push(term);
                scale.push(size);
                group.push(g);
            }
        }
        let residual = rows.iter().flat_map(|row| samples.residual[*row]);
        let unit = root_mean(residual.map(|v| v * v).sum());
        let p = terms.len();
        (unit > 0.0 && p > 0).then(|| Self {
            samples,
            rows,
            arm,
            terms,
            scale,
            group,
            unit,
            h: Mat::zeros(p, p),
            g: vec![0.0; p],
            squares: 0.0,
            count: 0.0,
        })
    }

    fn add_up(&mut self, weights: &[f64]) {
        self.h.fill(0.0);
        self.g.fill(0.0);
        (self.squares, self.count) = (0.0, 0.0);
        let mut basis = BasisFunctions::new(self.arm, &self.terms);
        let mut columns = Mat::<f64>::zeros(3 * CHUNK, self.terms.len());
        for (rows, weights) in self.rows.chunks(CHUNK).zip(weights.chunks(CHUNK)) {
            columns.fill(0.0);
            let mut residual = vec![0.0; 3 * rows.len()];
            for (r, (row, weight)) in rows.iter().zip(weights).enumerate() {
                let root = weight.sqrt();
                basis.at(&self.samples.sources[*row], |t, way| {
                    for (k, value) in way.into_iter().enumerate() {
                        columns[(3 * r + k, t)] = root * value / self.scale[t];
                    }
                });
                for (k, value) in self.samples.residual[*row].into_iter().enumerate() {
                    residual[3 * r + k] = root * value / self.unit;
                }
                self.count += 3.0 * weight;
            }
            self.squares += residual.iter().map(|v| v * v).sum::<f64>();
            for (t, g) in self.g.iter_mut().enumerate() {
                *g += residual
                    .iter()
                    .enumerate()
                    .map(|(r, value)| columns[(r, t)] * value)
                    .sum::<f64>();
            }
            let whole = BlockStructure::Rectangular;
            triangular::matmul(
                self.h.as_mut(),
                BlockStructure::TriangularLower,
                Accum::Add,
                columns.transpose(),
                whole,
                columns.as_ref(),
                whole,
                1.0,
                Par::Seq,
            );
        }
        for j in 0..self.terms.len() {
            for i in 0..j {
                self.h[(i, j)] = self.h[(j, i)];
            }
        }
    }

    /// Weighted sum of squares that coefficients `x` leave.
    fn misfit(&self, x: &[f64]) -> f64 {
        let quadratic: f64 = (0..x.len())
            .map(|j| x[j] * (0..x.len()).map(|i| self.h[(i, j)] * x[i]).sum::<f64>())
            .sum();
        self.squares - 2.0 * x.iter().zip(&self.g).map(|(x, g)| x * g).sum::<f64>() + quadratic
    }

    /// Huber's weights of the rows under coefficients `x`; `limit` is a length in units of the residual.
    fn weights(&self, x: &[f64], limit: f64) -> Vec<f64> {
        let mut basis = BasisFunctions::new(self.arm, &self.terms);
        let weight = |row: &usize| {
            let mut left = self.samples.residual[*row].map(|value| value / self.unit);
            basis.at(&self.samples.sources[*row], |t, way| {
                for (left, value) in left.iter_mut().zip(way) {
                    *left -= x[t] * value / self.scale[t];
                }
            });
            let length = left.iter().map(|v| v * v).sum::<f64>().sqrt();
            if length <= limit { 1.0 } else { limit / length }
        };
        self.rows.iter().map(weight).collect()
    }
}

/// The diagonal of the inverse of a matrix with this factor.
fn variances(llt: &Llt<f64>) -> Vec<f64> {
    let lower = llt.L();
    let mut inverse = Mat::zeros(lower.nrows(), lower.ncols());
    invert_lower_triangular(inverse.as_mut(), lower, Par::Seq);
    (0..inverse.ncols())
        .map(|j| {
            inverse.col_as_slice(j)[j..]
                .iter()
                .map(|value| value * value)
                .sum()
        })
        .collect()
}

/// A standard normal number (Box and Muller).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
