//! Evidence of a group of columns whose coefficients are normal about zero, over that of no such group: one function for a law of one column
//! and for a curve of forty.
//!
//! With columns X of unit rms motion, prior variances a^2 v_k (sum of v_k = 1) and L, z the eigenvalues and projected gradient of V^1/2 X'X V^1/2,
//! ln E(a) = -1/2 sum_k ln(1 + a^2 L_k) - (n + nu)/2 ln[1 - sum_k z_k^2 a^2 / (1 + a^2 L_k) / (nu + r'r)]: the scale of the noise is
//! integrated (inverse gamma about its statement with nu degrees of freedom), the amplitude a over a logarithmic grid.

use crate::linear::dot;
use calib_numerics::criteria::cells::{EXACT, LARGEST, NU, SMALLEST};
use nalgebra::{DMatrix, DVector};
use std::sync::LazyLock;

/// Amplitudes of the grid.
pub const AMPLITUDES: usize = 28;

/// How much the rows say: degrees of freedom and the squared residual, in standard deviations of the noise.
#[derive(Debug, Clone, Copy)]
pub struct EvidenceRows {
    /// Degrees of freedom.
    pub freedom: f64,
    /// Squared residual.
    pub square: f64,
}

/// What a group of columns says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupEvidence {
    /// ln of the evidence over that of no such group.
    pub log: f64,
    /// The likeliest amplitude, rms motion at the tool, m.
    pub amplitude: f64,
    /// ln of the evidence over that at the likeliest amplitude alone, as probable beforehand as all of the grid together.
    pub spread: f64,
    /// What the group explains of the squared residual at that amplitude.
    pub fit: f64,
}

impl GroupEvidence {
    /// Of a group that the rows do not see.
    pub const NONE: Self = Self {
        log: 0.0,
        amplitude: 0.0,
        spread: 0.0,
        fit: 0.0,
    };
}

/// The evidence of columns by their Gram matrix, their products with the residual (both in standard deviations of the noise), and the
/// shares of the prior variance.
pub fn evidence(
    gram: &DMatrix<f64>,
    gradient: &DVector<f64>,
    shares: &[f64],
    rows: EvidenceRows,
) -> GroupEvidence {
    evidence_between(gram, gradient, shares, rows, [0.0, f64::INFINITY])
}

/// The same where only amplitudes between two are possible, m.
pub fn evidence_between(
    gram: &DMatrix<f64>,
    gradient: &DVector<f64>,
    shares: &[f64],
    rows: EvidenceRows,
    between: [f64; 2],
) -> GroupEvidence {
    let Some((logs, fits)) = at_each(gram, gradient, shares, rows, between) else {
        return GroupEvidence::NONE;
    };
    let best = (0..AMPLITUDES)
        .max_by(|a, b| logs[*a].total_cmp(&logs[*b]))
        .unwrap_or(0);
    let all = log_sum(&logs);
    GroupEvidence {
        log: all - (possible(between).max(1) as f64).ln(),
        amplitude: GRID[best],
        spread: all - logs[best],
        fit: fits[best],
    }
}

/// ln of the evidence at each amplitude of the grid; of one that cannot be, minus infinity.
pub fn evidence_at(
    gram: &DMatrix<f64>,
    gradient: &DVector<f64>,
    shares: &[f64],
    rows: EvidenceRows,
    between: [f64; 2],
) -> [f64; AMPLITUDES] {
    at_each(gram, gradient, shares, rows, between).map_or([0.0; AMPLITUDES], |(logs, _)| logs)
}

/// How many amplitudes of the grid lie between two.
fn possible([low, high]: [f64; 2]) -> usize {
    let is_possible = |amplitude: &&f64| **amplitude >= low && **amplitude <= high;
    GRID.iter().filter(is_possible).count()
}

/// At each amplitude ln of the evidence and what is explained of the squared residual; none of columns that the rows do not see.
fn at_each(
    gram: &DMatrix<f64>,
    gradient: &DVector<f64>,
    shares: &[f64],
    rows: EvidenceRows,
    [low, high]: [f64; 2],
) -> Option<([f64; AMPLITUDES], [f64; AMPLITUDES])> {
    let kept: Vec<usize> = (0..shares.len()).filter(|k| shares[*k] > 0.0).collect();
    let squares = GRID.map(|amplitude| amplitude * amplitude);
    let (trace, (fits, determinants)) = if let [k] = kept[..] {
        let (diagonal, along) = (shares[k] * gram[(k, k)], shares[k].sqrt() * gradient[k]);
        (
            diagonal,
            at_amplitudes(&squares, &[diagonal], &[], &[along]),
        )
    } else {
        let roots: Vec<f64> = kept.iter().map(|k| shares[*k].sqrt()).collect();
        let matrix = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            roots[i] * gram[(kept[i], kept[j])] * roots[j]
        });
        let along = kept.iter().zip(&roots);
        let mut along: Vec<f64> = along.map(|(k, root)| root * gradient[*k]).collect();
        let (diagonal, off_diagonal) = tridiagonal(matrix, &mut along);
        (
            diagonal.iter().sum::<f64>(),
            at_amplitudes(&squares, &diagonal, &off_diagonal, &along),
        )
    };
    if trace.is_nan() || trace <= 0.0 {
        return None;
    }
    let (whole, half) = (*NU + rows.square, 0.5 * (rows.freedom + *NU));
    let mut logs = [f64::NEG_INFINITY; AMPLITUDES];
    for k in (0..AMPLITUDES).filter(|k| GRID[*k] >= low && GRID[*k] <= high) {
        // Noise is always left: what leaves none is rounding.
        let left = 1.0 - fits[k] / whole;
        if left > 1e-9 && squares[k] * trace < *EXACT {
            logs[k] = -0.5 * determinants[k] - half * left.ln();
        }
    }
    let is_seen = logs.iter().any(|log| *log > f64::NEG_INFINITY);
    is_seen.then_some((logs, fits))
}

/// The diagonal and the entries next to it of a symmetric matrix brought to tridiagonal form by reflections (Householder, 1958), which turn
/// `along`, too.
fn tridiagonal(mut matrix: DMatrix<f64>, along: &mut [f64]) -> (Vec<f64>, Vec<f64>) {
    let count = matrix.nrows();
    let (mut diagonal, mut off) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut image = vec![0.0; count];
    for k in 0..count {
        diagonal.push(matrix[(k, k)]);
        let (done, below) = matrix.as_mut_slice().split_at_mut((k + 1) * count);
        let (mirror, image) = (&mut done[k * (count + 1) + 1..], &mut image[k + 1..]);
        let Some(first) = mirror.first().copied() else {
            break;
        };
        let length = dot(mirror, mirror).sqrt();
        off.push(-length.copysign(first));
        if length == 0.0 {
            continue;
        }
        mirror[0] += length.copysign(first);
        let share = 2.0 / dot(mirror, mirror);
        for (value, column) in image.iter_mut().zip(below.chunks(count)) {
            *value = share * dot(&column[k + 1..], mirror);
        }
        let along_mirror = 0.5 * share * dot(image, mirror);
        let entries = image.iter_mut().zip(&*mirror);
        entries.for_each(|(value, by)| *value -= along_mirror * by);
        for ((column, by), value) in below.chunks_mut(count).zip(&*mirror).zip(&*image) {
            let both = mirror.iter().zip(&*image);
            let entries = column[k + 1..].iter_mut().zip(both);
            entries.for_each(|(entry, (a, b))| *entry -= a * value + b * by);
        }
        let turn = share * dot(mirror, &along[k + 1..]);
        let entries = along[k + 1..].iter_mut().zip(&*mirror);
        entries.for_each(|(value, by)| *value -= turn * by);
    }
    (diagonal, off)
}

/// At each squared amplitude, of a Gram matrix T in tridiagonal form: a^2 g' (1 + a^2 T)^-1 g, and ln det (1 + a^2 T).
fn at_amplitudes(
    squares: &[f64; AMPLITUDES],
    diagonal: &[f64],
    off: &[f64],
    along: &[f64],
) -> ([f64; AMPLITUDES], [f64; AMPLITUDES]) {
    let (mut pivots, mut products) = ([1.0; AMPLITUDES], [1.0; AMPLITUDES]);
    let (mut values, mut fits) = ([0.0; AMPLITUDES], [0.0; AMPLITUDES]);
    let mut logs = [0.0; AMPLITUDES];
    for (k, entry) in diagonal.iter().enumerate() {
        let next = if k > 0 { off[k - 1] } else { 0.0 };
        // All amplitudes in step: each waits for its own pivot before.
        for a in 0..AMPLITUDES {
            let (last, below) = (pivots[a], squares[a] * next);
            let share = below / last;
            // Rounding makes a pivot no smaller than one.
            pivots[a] = f64::max(1.0 + squares[a] * entry - below * share, 1.0);
            values[a] = along[k] - share * values[a];
            fits[a] += values[a] * values[a] / pivots[a];
            products[a] *= pivots[a];
        }
        // Logarithms cost more than products, which must not overflow; the largest amplitude has the largest.
        if products[AMPLITUDES - 1] > 1e200 {
            for (log, product) in logs.iter_mut().zip(&mut products) {
                *log += std::mem::replace(product, 1.0).ln();
            }
        }
    }
    for a in 0..AMPLITUDES {
        fits[a] *= squares[a];
        logs[a] += products[a].ln();
    }
    (fits, logs)
}

/// The amplitudes of the grid, m.
static GRID: LazyLock<[f64; AMPLITUDES]> = LazyLock::new(|| {
    let step = libm::pow(*LARGEST / *SMALLEST, 1.0 / (AMPLITUDES - 1) as f64);
    let mut next = *SMALLEST;
    std::array::from_fn(|_| {
        let amplitude = next;
        next *= step;
        amplitude
    })
});

/// ln of a sum of exponentials; minus infinity of none.
pub fn log_sum(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        most
    } else {
        most + logs.iter().map(|log| (log - most).exp()).sum::<f64>().ln()
    }
}

/// At each amplitude ln of a sum of exponentials.
pub fn log_sums(all: impl Iterator<Item = [f64; AMPLITUDES]>) -> [f64; AMPLITUDES] {
    let all: Vec<[f64; AMPLITUDES]> = all.collect();
    std::array::from_fn(|k| log_sum(&all.iter().map(|logs| logs[k]).collect::<Vec<_>>()))
}

/// ln of a mean of exponentials: equal prior odds.
#[cfg(test)]
fn log_mean(logs: &[f64]) -> f64 {
    log_sum(logs) - (logs.len().max(1) as f64).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: EvidenceRows = EvidenceRows {
        freedom: 300.0,
        square: 320.0,
    };

    #[test]
    fn one_column_has_the_evidence_of_its_integral() {
        // One column of squared length 4e6 and a residual 1e-5 along it: by hand over the grid.
        let (gram, gradient) = (
            DMatrix::from_element(1, 1, 4e6),
            DVector::from_element(1, 40.0),
        );
        let found = evidence(&gram, &gradient, &[1.0], ROWS);
        let one = |a: f64| {
            let s = a * a * 4e6;
            let fit = 40.0 * 40.0 / 4e6 * s / (1.0 + s);
            -0.5 * (1.0 + s).ln() - 0.5 * (300.0 + *NU) * (1.0 - fit / (*NU + 320.0)).ln()
        };
        let logs: Vec<f64> = GRID.iter().copied().map(one).collect();
        assert!(
            (found.log - log_mean(&logs)).abs() < 1e-12,
            "{} {}",
            found.log,
            log_mean(&logs)
        );
    }

    #[test]
    fn the_evidence_of_columns_that_are_not_orthogonal_is_that_of_their_covariance() {
        // Columns and a residual of 9 rows; the covariance of the rows as a whole instead of the columns' products.
        let entry =
            |i: usize, j: usize| (((5 * i + 3 * j * j + 2 * i * j) % 11) as f64 - 5.0) * 300.0;
        let columns = DMatrix::from_fn(9, 5, entry);
        let residual = DVector::from_fn(9, |i, _| ((7 * i) % 5) as f64 - 1.5);
        let shares = [0.1, 0.2, 0.05, 0.4, 0.25];
        let rows = EvidenceRows {
            freedom: 9.0,
            square: residual.norm_squared(),
        };
        let found = evidence(
            &columns.tr_mul(&columns),
            &columns.tr_mul(&residual),
            &shares,
            rows,
        );
        let at = |amplitude: f64| {
            let prior =
                DMatrix::from_diagonal(&DVector::from_row_slice(&shares)) * (amplitude * amplitude);
            let covariance = DMatrix::identity(9, 9) + &columns * prior * columns.transpose();
            let solved = covariance
                .clone()
                .lu()
                .solve(&residual)
                .expect("a covariance");
            let [with, without] = [residual.dot(&solved), residual.norm_squared()]
                .map(|square| 0.5 * (9.0 + *NU) * (*NU + square).ln());
            without - with - 0.5 * covariance.determinant().ln()
        };
        let logs: Vec<f64> = GRID.iter().copied().map(at).collect();
        assert!(
            (found.log - log_mean(&logs)).abs() < 1e-6,
            "{} {}",
            found.log,
            log_mean(&logs)
        );
    }

    #[test]
    fn columns_without_a_signal_cost_evidence_and_more_of_them_cost_more() {
        let none = |count: usize| {
            let gram = DMatrix::identity(count, count).scale(1e12);
            evidence(
                &gram,
                &DVector::zeros(count),
                &vec![1.0 / count as f64; count],
                ROWS,
            )
            .log
        };
        assert!(none(1) < 0.0 && none(8) < none(2) && none(2) < none(1));
    }
}
