//! Ridge on harmonics of the joints, with as many priors as groups of terms, each sized by the evidence (MacKay 1992).
//!
//! With `H = A^T W A`, coefficients of an axis are `beta C A^T W b`, `C = (beta H + diag alpha)^-1`; a group of `m` coefficients has
//! `gamma = m - alpha tr C` well-determined ones and takes `alpha = gamma / |x|^2`. Rows far off count less (Huber).

use super::perceptron::OUTPUTS;
use super::region::TrainingSamples;
use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Mat, Par, Side};
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Rows that are fitted at most, evenly spread: more say little new and cost time.
const ROWS: usize = 4000;
/// Highest order of the harmonics.
const HARMONICS: usize = 3;
/// Rounds of weights, and of priors within each.
const ROUNDS: usize = 2;
const PRIORS: usize = 4;
/// Rows so many sigmas off begin to count less.
const HUBER: f64 = 3.0;
/// Draws from the posterior that tell the spread.
const DRAWS: usize = 8;
/// Columns of a smaller root mean square are nothing.
const NOTHING: f64 = 1e-8;

/// A factor of a term. Joints from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wave {
    /// The sine of `order` times a joint's angle.
    Sin(usize, usize),
    /// The cosine of the same.
    Cos(usize, usize),
    /// The travel of a prismatic joint.
    Value(usize),
}

impl Wave {
    fn at(self, q: &[f64]) -> f64 {
        match self {
            Self::Sin(joint, order) => (order as f64 * q[joint]).sin(),
            Self::Cos(joint, order) => (order as f64 * q[joint]).cos(),
            Self::Value(joint) => q[joint],
        }
    }
}

/// The product of its waves; 1 without any.
pub type Term = Vec<Wave>;

fn value(term: &[Wave], q: &[f64]) -> f64 {
    term.iter().map(|wave| wave.at(q)).product()
}

/// Groups of terms: a constant, first orders of every joint, higher ones, and first orders of every two joints multiplied.
fn harmonics(prismatic: &[bool]) -> [Vec<Term>; 4] {
    let first = |joint: usize| match prismatic[joint] {
        true => vec![Wave::Value(joint)],
        false => vec![Wave::Sin(joint, 1), Wave::Cos(joint, 1)],
    };
    let joints = 0..prismatic.len();
    let revolute = joints.clone().filter(|joint| !prismatic[*joint]);
    let higher = revolute.flat_map(|joint| {
        (2..=HARMONICS).flat_map(move |k| [vec![Wave::Sin(joint, k)], vec![Wave::Cos(joint, k)]])
    });
    let mut pairs = Vec::new();
    for a in joints.clone() {
        for b in a + 1..prismatic.len() {
            for wave in first(a) {
                pairs.extend(first(b).into_iter().map(|other| vec![wave, other]));
            }
        }
    }
    let single = joints.flat_map(first).map(|wave| vec![wave]);
    [vec![Vec::new()], single.collect(), higher.collect(), pairs]
}

/// Terms and their coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Ridge {
    /// What is summed along each axis of the tracker's frame.
    pub terms: Vec<Term>,
    /// m, along each axis: the most likely coefficients, then draws from the posterior.
    pub members: Vec<Vec<[f64; OUTPUTS]>>,
    /// What is left per axis, m.
    pub noise: f64,
}

impl Ridge {
    /// The harmonics of joints that are prismatic or not. `None` where there is nothing to fit or the matrix is singular.
    pub fn fit(samples: &TrainingSamples, prismatic: &[bool], seed: u64) -> Option<Self> {
        let groups = harmonics(prismatic);
        let mut equations = Equations::new(samples, &groups)?;
        let (group, p) = (equations.group.clone(), equations.group.len());
        let counts: Vec<f64> = (0..groups.len())
            .map(|g| (OUTPUTS * group.iter().filter(|of| **of == g).count()) as f64)
            .collect();
        // In units of the residual: each column starts as a tenth of it, and half of it as noise.
        let (mut alpha, mut beta) = (vec![100.0; groups.len()], 4.0);
        let mut x = Mat::<f64>::zeros(p, OUTPUTS);
        let mut factor = None;
        for _ in 0..ROUNDS {
            equations.add_up();
            for _ in 0..PRIORS {
                let posterior = Mat::from_fn(p, p, |i, j| {
                    beta * equations.h[(i, j)] + if i == j { alpha[group[i]] } else { 0.0 }
                });
                let llt = Llt::new(posterior.as_ref(), Side::Lower).ok()?;
                x = llt.solve(Mat::from_fn(p, OUTPUTS, |i, k| beta * equations.g[(i, k)]));
                let inverse = llt.inverse();
                let mut determined = 0.0;
                for (g, alpha) in alpha.iter_mut().enumerate() {
                    let (mut trace, mut squares) = (0.0, 0.0);
                    for i in (0..p).filter(|i| group[*i] == g) {
                        trace += OUTPUTS as f64 * inverse[(i, i)];
                        squares += (0..OUTPUTS).map(|k| x[(i, k)].powi(2)).sum::<f64>();
                    }
                    let gamma = (counts[g] - *alpha * trace).clamp(1e-3, counts[g].max(1e-3));
                    determined += gamma;
                    *alpha = (gamma / squares.max(1e-12)).clamp(1e-2, 1e10);
                }
                let left = equations.misfit(&x).max(1e-12);
                let free = OUTPUTS as f64 * equations.weights.iter().sum::<f64>() - determined;
                beta = (free.max(1.0) / left).clamp(1e-3, 1e12);
                factor = Some(llt);
            }
            equations.weigh(&x, HUBER * (OUTPUTS as f64).sqrt() / beta.sqrt());
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draws = Mat::<f64>::zeros(p, OUTPUTS * DRAWS);
        for d in 0..DRAWS {
            for i in 0..p {
                for k in 0..OUTPUTS {
                    draws[(i, OUTPUTS * d + k)] = normal(&mut rng);
                }
            }
        }
        solve_upper_triangular_in_place(factor?.L().transpose(), draws.as_mut(), Par::Seq);
        let (unit, scale) = (equations.unit, &equations.scale);
        let member = |off: &dyn Fn(usize, usize) -> f64| -> Vec<[f64; OUTPUTS]> {
            (0..p)
                .map(|i| std::array::from_fn(|k| (x[(i, k)] + off(i, k)) * unit / scale[i]))
                .collect()
        };
        let mut members = vec![member(&|_, _| 0.0)];
        members.extend((0..DRAWS).map(|d| member(&|i, k| draws[(i, OUTPUTS * d + k)])));
        Some(Self {
            terms: equations.terms,
            members,
            noise: unit / beta.sqrt(),
        })
    }

    /// The correction and its standard deviation per axis without the noise, m.
    pub(crate) fn at(&self, q: &[f64]) -> ([f64; OUTPUTS], f64) {
        let mut sums = vec![[0.0; OUTPUTS]; self.members.len()];
        for (t, term) in self.terms.iter().enumerate() {
            let value = value(term, q);
            for (sum, member) in sums.iter_mut().zip(&self.members) {
                for (sum, coefficient) in sum.iter_mut().zip(member[t]) {
                    *sum += coefficient * value;
                }
            }
        }
        let Some((mean, draws)) = sums.split_first() else {
            return ([0.0; OUTPUTS], 0.0);
        };
        let off = draws.iter().flatten().zip(mean.iter().cycle());
        let squares: f64 = off.map(|(value, mean)| (value - mean).powi(2)).sum();
        let count = (OUTPUTS * draws.len().max(1)) as f64;
        (*mean, (squares / count).sqrt())
    }
}

/// Scaled columns, the residual in units of its root mean square, and their normal equations.
struct Equations {
    /// Those that move the point anywhere, the root mean square of each, and its group.
    terms: Vec<Term>,
    scale: Vec<f64>,
    group: Vec<usize>,
    /// Root mean square of the residual, m.
    unit: f64,
    a: Mat<f64>,
    b: Mat<f64>,
    weights: Vec<f64>,
    h: Mat<f64>,
    g: Mat<f64>,
    /// Weighted sum of squared residuals.
    squares: f64,
}

impl Equations {
    /// `None` where nothing moves.
    fn new(samples: &TrainingSamples, groups: &[Vec<Term>]) -> Option<Self> {
        let every = samples.rows().div_ceil(ROWS).max(1);
        let rows: Vec<usize> = (0..samples.rows()).step_by(every).collect();
        let count = (OUTPUTS * rows.len()).max(1) as f64;
        let (mut terms, mut scale, mut group) = (Vec::new(), Vec::new(), Vec::new());
        for (g, term) in groups
            .iter()
            .enumerate()
            .flat_map(|(g, t)| t.iter().map(move |t| (g, t)))
        {
            let values = rows.iter().map(|row| value(term, &samples.sources[*row]));
            let size = (values.map(|v| v * v).sum::<f64>() / count).sqrt();
            if size > NOTHING {
                terms.push(term.clone());
                scale.push(size);
                group.push(g);
            }
        }
        let residual = rows.iter().flat_map(|row| samples.residual[*row]);
        let unit = (residual.map(|v| v * v).sum::<f64>() / count).sqrt();
        let (n, p) = (rows.len(), terms.len());
        (unit > 0.0 && p > 0).then(|| Self {
            a: Mat::from_fn(n, p, |r, t| {
                value(&terms[t], &samples.sources[rows[r]]) / scale[t]
            }),
            b: Mat::from_fn(n, OUTPUTS, |r, k| samples.residual[rows[r]][k] / unit),
            weights: vec![1.0; n],
            h: Mat::zeros(p, p),
            g: Mat::zeros(p, OUTPUTS),
            squares: 0.0,
            terms,
            scale,
            group,
            unit,
        })
    }

    fn add_up(&mut self) {
        let weighted = Mat::from_fn(self.a.nrows(), self.a.ncols(), |r, t| {
            self.weights[r] * self.a[(r, t)]
        });
        self.h = weighted.transpose() * &self.a;
        self.g = weighted.transpose() * &self.b;
        let row = |(r, weight): (usize, &f64)| {
            weight * (0..OUTPUTS).map(|k| self.b[(r, k)].powi(2)).sum::<f64>()
        };
        self.squares = self.weights.iter().enumerate().map(row).sum();
    }

    /// Weighted sum of squares that coefficients `x` leave.
    fn misfit(&self, x: &Mat<f64>) -> f64 {
        let half = &self.h * x;
        let cells = (0..x.nrows()).flat_map(|i| (0..OUTPUTS).map(move |k| (i, k)));
        let gained = cells.map(|at| x[at] * (2.0 * self.g[at] - half[at]));
        self.squares - gained.sum::<f64>()
    }

    /// Huber's weights of the rows under coefficients `x`; `limit` is a length in units of the residual.
    fn weigh(&mut self, x: &Mat<f64>, limit: f64) {
        let left = &self.b - &self.a * x;
        for (r, weight) in self.weights.iter_mut().enumerate() {
            let length = (0..OUTPUTS)
                .map(|k| left[(r, k)].powi(2))
                .sum::<f64>()
                .sqrt();
            *weight = if length <= limit { 1.0 } else { limit / length };
        }
    }
}

/// A standard normal number (Box and Muller).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
