//! The uncertainty of a fit: of parameters, of pairs of them, and of the positions that they predict.
//!
//! Fisher's F distribution by the incomplete beta function (continued fraction after Lentz; Numerical Recipes, Sec. 6.4).

use crate::estimate::factor::{Triangle, dot};
use crate::estimate::model::Model;
use crate::estimate::problem::columns;
use crate::robot::Measurements;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Covariance of the free parameters as `root * root^T`.
#[derive(Debug, Clone)]
pub struct Covariance {
    /// Positions of the free parameters in the stack.
    free: Vec<usize>,
    /// p x p.
    root: Triangle,
}

impl Covariance {
    /// From a root.
    pub(crate) fn new(root: Triangle, free: &[usize]) -> Self {
        Self {
            free: free.to_vec(),
            root,
        }
    }

    /// From the covariance (SI) of pairs of parameters of the stack, each once with the smaller position first; pairs that are not there
    /// are independent. `None` of no pairs, and where it is no covariance.
    pub fn of_pairs(values: &BTreeMap<(usize, usize), f64>) -> Option<Self> {
        let free: Vec<usize> = values
            .keys()
            .filter(|(a, b)| a == b)
            .map(|(a, _)| *a)
            .collect();
        let p = free.len();
        let sigma: Vec<f64> = free.iter().map(|k| values[&(*k, *k)].sqrt()).collect();
        // Factored from the last row up: the root is upper triangular.
        let correlation = DMatrix::from_fn(p, p, |i, j| {
            let (a, b) = (p - 1 - i, p - 1 - j);
            let value = values
                .get(&(free[a.min(b)], free[a.max(b)]))
                .copied()
                .unwrap_or(0.0);
            value / (sigma[a] * sigma[b])
        });
        let factor = correlation.cholesky()?.unpack();
        let root = Triangle::from_fn(p, |i, j| sigma[i] * factor[(p - 1 - i, p - 1 - j)]);
        (p > 0).then_some(Self { free, root })
    }

    /// Positions in the stack of the parameters that it is of.
    pub fn parameters(&self) -> &[usize] {
        &self.free
    }

    /// Every pair of parameters of the stack once, each with itself too: their covariance (SI) and correlation.
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize, f64, f64)> + '_ {
        let sigma: Vec<f64> = (0..self.free.len()).map(|row| self.sigma(row)).collect();
        let pairs = (0..self.free.len()).flat_map(|a| (a..self.free.len()).map(move |b| (a, b)));
        pairs.map(move |(a, b)| {
            let value = self.product(a, b);
            let correlation = if a == b {
                1.0
            } else {
                (value / (sigma[a] * sigma[b])).clamp(-1.0, 1.0)
            };
            (self.free[a], self.free[b], value, correlation)
        })
    }

    fn row(&self, parameter: usize) -> Option<usize> {
        self.free.iter().position(|free| *free == parameter)
    }

    fn rows(&self, parameters: &[usize]) -> Option<Vec<usize>> {
        parameters.iter().map(|k| self.row(*k)).collect()
    }

    /// The covariance (SI) of some of the parameters, in their order; `None` where one of them was not estimated.
    pub fn block(&self, parameters: &[usize]) -> Option<DMatrix<f64>> {
        let rows = self.rows(parameters)?;
        Some(DMatrix::from_fn(rows.len(), rows.len(), |a, b| {
            self.product(rows[a], rows[b])
        }))
    }

    /// Covariance (m2) of a point with these derivatives (m per unit) by [`Covariance::parameters`].
    pub(crate) fn of_point(&self, jacobian: &[Vector3<f64>]) -> Matrix3<f64> {
        let along = |k: usize| -> Vector3<f64> {
            self.root
                .column(k)
                .iter()
                .zip(jacobian)
                .map(|(root, by)| by * *root)
                .sum()
        };
        (0..self.free.len())
            .map(along)
            .map(|along| along * along.transpose())
            .sum()
    }

    /// Variance of what has these derivatives (SI) by [`Covariance::parameters`].
    pub(crate) fn along(&self, derivatives: &[f64]) -> f64 {
        (0..self.free.len())
            .map(|k| dot(derivatives, self.root.column(k)).powi(2))
            .sum()
    }

    /// The same where only some parameters, by their rows, have an effect.
    pub(crate) fn along_rows(&self, derivatives: &[f64], rows: &[usize]) -> f64 {
        let by_column = |k: usize| {
            rows.iter()
                .map(|row| derivatives[*row] * self.root.at(*row, k))
                .sum::<f64>()
                .powi(2)
        };
        (0..self.free.len()).map(by_column).sum()
    }

    /// Standard deviation of the `row`-th free parameter, SI.
    pub(crate) fn sigma(&self, row: usize) -> f64 {
        self.root.row_norm(row)
    }

    fn product(&self, a: usize, b: usize) -> f64 {
        (a.max(b)..self.free.len())
            .map(|column| self.root.at(a, column) * self.root.at(b, column))
            .sum()
    }

    /// The squared distance of `values` of some free parameters from zero, in standard deviations: chi-square of as many degrees of
    /// freedom where nothing is there. `None` where one of them is not free.
    pub fn distance(&self, parameters: &[usize], values: &[f64]) -> Option<f64> {
        let rows = self.rows(parameters)?;
        let sigma: Vec<f64> = rows.iter().map(|row| self.sigma(*row)).collect();
        let correlation = DMatrix::from_fn(rows.len(), rows.len(), |a, b| {
            self.product(rows[a], rows[b]) / (sigma[a] * sigma[b])
        });
        let scaled = DVector::from_iterator(
            rows.len(),
            values
                .iter()
                .zip(&sigma)
                .map(|(value, sigma)| value / sigma),
        );
        Some(scaled.dot(&correlation.cholesky()?.solve(&scaled)))
    }

    /// The other free parameter that a parameter of the stack is most correlated with, and the correlation.
    pub fn closest(&self, parameter: usize) -> Option<(usize, f64)> {
        let row = self.row(parameter)?;
        let sigma = self.sigma(row);
        (0..self.free.len())
            .filter(|other| *other != row)
            .map(|other| {
                (
                    self.free[other],
                    self.product(row, other) / (sigma * self.sigma(other)),
                )
            })
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// Standard deviation (m, length: root of the summed variances) of every row's predicted position from the parameters' alone.
    pub fn of_predictions(&self, model: &Model, data: &Measurements) -> Vec<f64> {
        let p = self.free.len();
        let column = columns(model, &self.free);
        (0..data.rows())
            .into_par_iter()
            .map_init(
                || {
                    (
                        model.stack.scratch(&model.robot),
                        vec![Vector3::zeros(); p],
                        [(); 3].map(|()| vec![0.0; p]),
                    )
                },
                |(scratch, jacobian, lines), row| {
                    jacobian.fill(Vector3::zeros());
                    model.stack.derivatives(
                        &model.robot,
                        data,
                        row,
                        &model.x,
                        scratch,
                        |parameter, derivative| {
                            if let Some(j) = column[parameter] {
                                jacobian[j] += derivative;
                            }
                        },
                    );
                    for (axis, line) in lines.iter_mut().enumerate() {
                        line.iter_mut()
                            .zip(&*jacobian)
                            .for_each(|(value, derivative)| *value = derivative[axis]);
                    }
                    let along = |k: usize| {
                        lines
                            .iter()
                            .map(|line| dot(line, self.root.column(k)).powi(2))
                            .sum::<f64>()
                    };
                    (0..p).map(along).sum::<f64>().sqrt()
                },
            )
            .collect()
    }
}

/// The chance that F with these degrees of freedom exceeds `ratio`.
pub fn tail(ratio: f64, numerator: f64, denominator: f64) -> f64 {
    if !ratio.is_finite() {
        return 0.0;
    }
    incomplete_beta(
        0.5 * denominator,
        0.5 * numerator,
        denominator / (denominator + numerator * ratio.max(0.0)),
    )
}

fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    let front =
        (libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (-x).ln_1p())
            .exp();
    // The fraction converges fast on this side of the mean only.
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(a, b, x) / a
    } else {
        1.0 - front * fraction(b, a, 1.0 - x) / b
    }
}

fn fraction(a: f64, b: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let away = |value: f64| if value.abs() < TINY { TINY } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / away(1.0 - (a + b) * x / (a + 1.0));
    let mut product = d;
    // Some multiple of the root of the larger degree of freedom is enough: this serves up to 10^8.
    for m in 1..100_000 {
        let m = f64::from(m);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / away(1.0 + term * d);
            c = away(1.0 + term / c);
            product *= d * c;
        }
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::tail;

    // From scipy.stats.f.sf of scipy 1.17.
    #[test]
    fn tails_are_those_of_scipy() {
        let cases = [
            (1.0, 5.0, 7.0, 0.4812939129582055),
            (2.5, 3.0, 40.0, 0.07325435201794983),
            (0.2, 300.0, 12.0, 0.9999998582083758),
            (8.0, 400.0, 160.0, 2.451374321893726e-39),
            (1.1, 20000.0, 3000.0, 0.0003430975184520901),
        ];
        for (ratio, numerator, denominator, expected) in cases {
            let found = tail(ratio, numerator, denominator);
            assert!(
                (found / expected - 1.0).abs() < 1e-9,
                "F {ratio} ({numerator}, {denominator}): {found:e} for {expected:e}"
            );
        }
        assert_eq!(tail(0.0, 3.0, 7.0), 1.0);
    }
}
