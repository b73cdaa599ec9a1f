//! Evidence of a group of columns whose coefficients are normal about zero, over that of none of it: one function for laws and for free
//! forms, so that their prices are commensurable.
//!
//! With x ~ N(0, a^2 V): ln E(a) = 1/2 sum_k [ z_k^2 a^2 s_k / (1 + a^2 s_k) - ln(1 + a^2 s_k) ], where s and z are eigenvalues and projected
//! gradient of V^1/2 G V^1/2 (computed on its tridiagonal form); the amplitude `a` is integrated over a logarithmic grid, since the largest evidence alone is biased upwards.

use crate::criteria::open_world::NEGLIGIBLE;
use crate::diagnose::pool::dot;
use nalgebra::{DMatrix, DVector};

/// Amplitudes, rms motion of the tool in m: below the first no instrument sees it, above the last it is a wrong set-up.
const SMALLEST: f64 = 1e-6;
const LARGEST: f64 = 1e-2;
const AMPLITUDES: usize = 29;

/// What a group of columns says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GroupEvidence {
    /// ln of the evidence over that of no such group.
    pub log: f64,
    /// The likeliest amplitude, m.
    pub amplitude: f64,
}

impl GroupEvidence {
    /// The evidence of a group that the data do not see.
    const NONE: Self = Self { log: 0.0, amplitude: SMALLEST };

    /// Whether the amplitude is none that a group of an arm can have.
    pub fn is_off_the_grid(&self) -> bool {
        self.amplitude >= 0.99 * LARGEST
    }
}

/// The evidence of columns by their Gram matrix, their products with the residual (both in standard deviations of the noise), and the prior
/// variances of their coefficients at an amplitude of 1 m.
pub(super) fn evidence(gram: &DMatrix<f64>, gradient: &DVector<f64>, variances: &[f64]) -> GroupEvidence {
    // What hardly varies beforehand costs time and says nothing.
    let most = variances.iter().copied().fold(0.0, f64::max);
    let kept: Vec<usize> = (0..variances.len()).filter(|k| variances[*k] > *NEGLIGIBLE * most).collect();
    let roots: Vec<f64> = kept.iter().map(|k| variances[*k].sqrt()).collect();
    let count = roots.len();
    let scaled = DMatrix::from_fn(count, count, |i, j| roots[i] * gram[(kept[i], kept[j])] * roots[j]);
    let mut along = DVector::from_fn(count, |i, _| roots[i] * gradient[kept[i]]);
    if scaled.trace().is_nan() || scaled.trace() <= 0.0 {
        return GroupEvidence::NONE;
    }
    let (diagonal, beside) = tridiagonal(scaled, along.as_mut_slice());
    let mut logs = [0.0; AMPLITUDES];
    for (log, amplitude) in logs.iter_mut().zip(amplitudes()) {
        *log = at_amplitude(amplitude * amplitude, &diagonal, &beside, &along);
    }
    let best = (0..AMPLITUDES).max_by(|a, b| logs[*a].total_cmp(&logs[*b])).unwrap_or(0);
    let amplitude = amplitudes().nth(best).unwrap_or(SMALLEST);
    GroupEvidence { log: log_mean(&logs), amplitude }
}

/// The diagonal and what is beside it of a symmetric matrix brought to tridiagonal form by reflections (Householder, 1958), which turn
/// `along`, too.
fn tridiagonal(mut matrix: DMatrix<f64>, along: &mut [f64]) -> (Vec<f64>, Vec<f64>) {
    let count = matrix.nrows();
    let (mut diagonal, mut beside) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut image = vec![0.0; count];
    for k in 0..count {
        diagonal.push(matrix[(k, k)]);
        let (done, rest) = matrix.as_mut_slice().split_at_mut((k + 1) * count);
        let (mirror, image) = (&mut done[k * (count + 1) + 1..], &mut image[k + 1..]);
        let Some(first) = mirror.first().copied() else { break };
        let length = dot(mirror, mirror).sqrt();
        beside.push(-length.copysign(first));
        if length == 0.0 {
            continue;
        }
        mirror[0] += length.copysign(first);
        let share = 2.0 / dot(mirror, mirror);
        for (value, column) in image.iter_mut().zip(rest.chunks(count)) {
            *value = share * dot(&column[k + 1..], mirror);
        }
        let own = 0.5 * share * dot(image, mirror);
        image.iter_mut().zip(&*mirror).for_each(|(value, by)| *value -= own * by);
        for ((column, by), value) in rest.chunks_mut(count).zip(&*mirror).zip(&*image) {
            let both = mirror.iter().zip(&*image);
            column[k + 1..].iter_mut().zip(both).for_each(|(entry, (a, b))| *entry -= a * value + b * by);
        }
        let turn = share * dot(mirror, &along[k + 1..]);
        along[k + 1..].iter_mut().zip(&*mirror).for_each(|(value, by)| *value -= turn * by);
    }
    (diagonal, beside)
}

/// ln of the evidence at a squared amplitude, of a Gram matrix T in tridiagonal form: (a^2 g' (1 + a^2 T)^-1 g - ln det (1 + a^2 T)) / 2.
fn at_amplitude(square: f64, diagonal: &[f64], beside: &[f64], along: &DVector<f64>) -> f64 {
    let (mut pivot, mut value, mut fit, mut log, mut product) = (1.0, 0.0, 0.0, 0.0, 1.0);
    for (k, own) in diagonal.iter().enumerate() {
        // Rounding makes a pivot no smaller than one.
        let (last, off) = (pivot, if k > 0 { square * beside[k - 1] } else { 0.0 });
        pivot = f64::max(1.0 + square * own - off * off / last, 1.0);
        value = along[k] - off / last * value;
        fit += value * value / pivot;
        product *= pivot;
        // Logarithms cost more than products, which must not overflow.
        if product > 1e200 {
            log += product.ln();
            product = 1.0;
        }
    }
    0.5 * (square * fit - log - product.ln())
}

fn amplitudes() -> impl Iterator<Item = f64> {
    let step = libm::pow(LARGEST / SMALLEST, 1.0 / (AMPLITUDES - 1) as f64);
    std::iter::successors(Some(SMALLEST), move |amplitude| Some(amplitude * step)).take(AMPLITUDES)
}

/// ln of a sum of exponentials; minus infinity of none.
pub(super) fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY { most } else { most + logs.iter().map(|log| (log - most).exp()).sum::<f64>().ln() }
}

/// ln of a mean of exponentials: equal prior odds.
pub(super) fn log_mean(logs: &[f64]) -> f64 {
    log_sum(logs) - (logs.len().max(1) as f64).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_column_has_the_evidence_of_its_integral() {
        // One column of length 2000 and a residual 0.004 along it: by hand over the grid.
        let (gram, gradient) = (DMatrix::from_element(1, 1, 4e6), DVector::from_element(1, 4e6 * 0.004));
        let found = evidence(&gram, &gradient, &[1.0]);
        let logs: Vec<f64> = amplitudes()
            .map(|a| {
                let s = a * a * 4e6;
                0.5 * (4e6 * 0.004 * 0.004 * s / (1.0 + s) - (1.0 + s).ln())
            })
            .collect();
        assert!((found.log - log_mean(&logs)).abs() < 1e-12);
        assert!((2e-3..8e-3).contains(&found.amplitude), "{found:?}");
    }

    #[test]
    fn the_evidence_of_columns_that_are_not_orthogonal_is_that_of_their_covariance() {
        // Columns and a residual of 9 rows; the covariance of the rows as a whole instead of the columns' products.
        let entry = |i: usize, j: usize| (((5 * i + 3 * j * j + 2 * i * j) % 11) as f64 - 5.0) * 300.0;
        let columns = DMatrix::from_fn(9, 5, entry);
        let residual = DVector::from_fn(9, |i, _| ((7 * i) % 5) as f64 - 1.5);
        let variances = [1.0, 0.5, 0.25, 2.0, 1.5];
        let found = evidence(&columns.tr_mul(&columns), &columns.tr_mul(&residual), &variances);
        let at = |amplitude: f64| {
            let prior = DMatrix::from_diagonal(&DVector::from_row_slice(&variances)) * (amplitude * amplitude);
            let covariance = DMatrix::identity(9, 9) + &columns * prior * columns.transpose();
            let solved = covariance.clone().lu().solve(&residual).expect("a covariance");
            0.5 * (residual.norm_squared() - residual.dot(&solved) - covariance.determinant().ln())
        };
        let logs: Vec<f64> = amplitudes().map(at).collect();
        assert!((found.log - log_mean(&logs)).abs() < 1e-8, "{} {}", found.log, log_mean(&logs));
    }

    #[test]
    fn columns_without_a_signal_cost_evidence_and_more_of_them_cost_more() {
        let none =
            |count: usize| evidence(&DMatrix::identity(count, count).scale(1e8), &DVector::zeros(count), &vec![1.0; count]).log;
        assert!(none(1) < 0.0 && none(8) < none(2) && none(2) < none(1));
    }
}
