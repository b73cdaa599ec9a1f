//! A Gaussian process with a squared exponential kernel, a length for each input, and the three axes apart but alike.
//!
//! `k(x, x') = s^2 exp(-1/2 sum (x - x')^2 / l^2)`; lengths, signal and noise maximise the marginal likelihood (Rasmussen and
//! Williams 2006, Eqs. 2.30 and 5.9) on at most `TUNED` rows; at most `ROWS` rows are remembered.

use super::descent::descend;
use super::perceptron::OUTPUTS;
use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, Par, Side};

/// Rows remembered at most: one prediction costs their square.
const ROWS: usize = 600;
/// Rows that the lengths are chosen on.
const TUNED: usize = 200;
/// Iterations of that choice.
const ITERATIONS: usize = 40;
/// Standard deviation of the logarithm of a length, the signal or the noise beforehand: holds them where rows say nothing.
const PLAUSIBLE: f64 = 2.0;

/// What the process remembers; inputs and outputs scaled.
#[derive(Debug, Clone, PartialEq)]
pub struct Process {
    /// Length scale of each input, in scaled units.
    pub lengths: Vec<f64>,
    /// Standard deviation of the function.
    pub signal: f64,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Inputs of each row.
    pub rows: Vec<Vec<f64>>,
    /// `(K + noise^2)^-1 y` of each row and axis.
    pub alpha: Vec<[f64; OUTPUTS]>,
    /// The lower factor of `K + noise^2`.
    factor: Mat<f64>,
}

impl Process {
    /// A process on scaled rows. `None` where its matrix is singular.
    pub fn fit(x: &[Vec<f64>], y: &[[f64; OUTPUTS]]) -> Option<Self> {
        let width = x.first()?.len();
        let thin = |most: usize| (0..x.len()).step_by(x.len().div_ceil(most).max(1));
        let tuned: Vec<usize> = thin(TUNED).collect();
        let few = Tuning {
            x: tuned.iter().map(|r| x[*r].clone()).collect(),
            y: tuned.iter().map(|r| y[*r]).collect(),
            start: prior(width),
        };
        let chosen = descend(
            |theta, gradient| (few.value(theta, gradient), [0.0; OUTPUTS]),
            |_| None,
            prior(width),
            ITERATIONS,
        );
        let theta = chosen.parameters;
        let lengths = theta[..width].iter().map(|l| l.exp()).collect();
        let rows: Vec<Vec<f64>> = thin(ROWS).map(|r| x[r].clone()).collect();
        let targets: Vec<[f64; OUTPUTS]> = thin(ROWS).map(|r| y[r]).collect();
        let (signal, noise) = (theta[width].exp(), theta[width + 1].exp());
        let (mut process, llt) = Self::factored(lengths, signal, noise, rows)?;
        let solved = llt.solve(Mat::from_fn(targets.len(), OUTPUTS, |r, k| targets[r][k]));
        process.alpha = (0..targets.len())
            .map(|r| std::array::from_fn(|k| solved[(r, k)]))
            .collect();
        Some(process)
    }

    /// The process from what its table holds. `None` where its matrix is singular.
    pub fn remember(
        lengths: Vec<f64>,
        signal: f64,
        noise: f64,
        rows: Vec<Vec<f64>>,
        alpha: Vec<[f64; OUTPUTS]>,
    ) -> Option<Self> {
        let (process, _) = Self::factored(lengths, signal, noise, rows)?;
        Some(Self { alpha, ..process })
    }

    fn factored(
        lengths: Vec<f64>,
        signal: f64,
        noise: f64,
        rows: Vec<Vec<f64>>,
    ) -> Option<(Self, Llt<f64>)> {
        let mut process = Self {
            lengths,
            signal,
            noise,
            rows,
            alpha: Vec::new(),
            factor: Mat::new(),
        };
        let llt = Llt::new(process.matrix().as_ref(), Side::Lower).ok()?;
        process.factor = llt.L().to_owned();
        Some((process, llt))
    }

    fn matrix(&self) -> Mat<f64> {
        let n = self.rows.len();
        let diagonal = self.signal * self.signal + self.noise * self.noise;
        Mat::from_fn(n, n, |i, j| {
            if i == j {
                diagonal
            } else {
                self.kernel(&self.rows[i], &self.rows[j])
            }
        })
    }

    fn kernel(&self, a: &[f64], b: &[f64]) -> f64 {
        let square: f64 = a
            .iter()
            .zip(b)
            .zip(&self.lengths)
            .map(|((a, b), l)| ((a - b) / l).powi(2))
            .sum();
        self.signal * self.signal * (-0.5 * square).exp()
    }

    /// Mean of each output and the standard deviation of all beside the noise, scaled.
    pub(crate) fn at(&self, x: &[f64]) -> ([f64; OUTPUTS], f64) {
        let near: Vec<f64> = self.rows.iter().map(|row| self.kernel(x, row)).collect();
        let mut mean = [0.0; OUTPUTS];
        for (near, alpha) in near.iter().zip(&self.alpha) {
            for (mean, alpha) in mean.iter_mut().zip(alpha) {
                *mean += near * alpha;
            }
        }
        let mut known = Mat::from_fn(near.len(), 1, |r, _| near[r]);
        solve_lower_triangular_in_place(self.factor.as_ref(), known.as_mut(), Par::Seq);
        let explained: f64 = (0..near.len()).map(|r| known[(r, 0)] * known[(r, 0)]).sum();
        (
            mean,
            (self.signal * self.signal - explained).max(0.0).sqrt(),
        )
    }
}

/// Logarithms of lengths, signal and noise before any row was seen: smooth, and half of it noise.
fn prior(width: usize) -> Vec<f64> {
    let length = 1.5 * (width as f64).sqrt();
    let mut theta = vec![length.ln(); width];
    theta.extend([0.8_f64.ln(), 0.6_f64.ln()]);
    theta
}

struct Tuning {
    x: Vec<Vec<f64>>,
    y: Vec<[f64; OUTPUTS]>,
    start: Vec<f64>,
}

impl Tuning {
    /// Minus the logarithm of the marginal likelihood and of the prior, per row; its gradient is written to `gradient`.
    fn value(&self, theta: &[f64], gradient: &mut [f64]) -> f64 {
        let (n, width) = (self.x.len(), theta.len() - 2);
        let signal = (2.0 * theta[width]).exp();
        let noise = (2.0 * theta[width + 1]).exp();
        let rates: Vec<f64> = theta[..width].iter().map(|l| (-2.0 * l).exp()).collect();
        let smooth = Mat::from_fn(n, n, |i, j| {
            let square: f64 = self.x[i]
                .iter()
                .zip(&self.x[j])
                .zip(&rates)
                .map(|((a, b), rate)| (a - b).powi(2) * rate)
                .sum();
            signal * (-0.5 * square).exp()
        });
        let matrix = Mat::from_fn(n, n, |i, j| {
            smooth[(i, j)] + if i == j { noise + 1e-9 } else { 0.0 }
        });
        let Ok(llt) = Llt::new(matrix.as_ref(), Side::Lower) else {
            gradient.fill(0.0);
            return f64::INFINITY;
        };
        let inverse = llt.inverse();
        let alpha = llt.solve(Mat::from_fn(n, OUTPUTS, |r, k| self.y[r][k]));
        let fit: f64 = (0..n)
            .flat_map(|r| (0..OUTPUTS).map(move |k| (r, k)))
            .map(|(r, k)| self.y[r][k] * alpha[(r, k)])
            .sum();
        let determinant: f64 = (0..n).map(|i| llt.L()[(i, i)].ln()).sum::<f64>() * 2.0;
        let each = 1.0 / n as f64;
        gradient.fill(0.0);
        for j in 0..n {
            for i in 0..=j {
                let product: f64 = (0..OUTPUTS).map(|k| alpha[(i, k)] * alpha[(j, k)]).sum();
                let pull = product - OUTPUTS as f64 * inverse[(i, j)];
                let both = if i == j { 0.5 } else { 1.0 };
                let along = both * pull * smooth[(i, j)] * each;
                gradient[width] -= 2.0 * along;
                for (d, rate) in rates.iter().enumerate() {
                    gradient[d] -= along * (self.x[i][d] - self.x[j][d]).powi(2) * rate;
                }
                if i == j {
                    gradient[width + 1] -= pull * noise * each;
                }
            }
        }
        let mut value = 0.5 * each * (fit + OUTPUTS as f64 * determinant);
        for ((theta, start), gradient) in theta.iter().zip(&self.start).zip(gradient) {
            let off = (theta - start) / PLAUSIBLE;
            value += 0.5 * each * off * off;
            *gradient += each * off / PLAUSIBLE;
        }
        value
    }
}
