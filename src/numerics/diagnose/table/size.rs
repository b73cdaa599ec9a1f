//! How large a cause is: the likelihood of its rms motion, whatever the direction of its coefficients.
//!
//! By Bayes' theorem the evidence of a size A is that of normal coefficients times the density of A after the rows over that before them;
//! both are densities of quadratic forms of normal variables, by their saddle points (Kuonen, 1999). Rows of few columns and of many that
//! hardly show are one case.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The size of a cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeEvidence {
    /// The likeliest, in the unit of the columns.
    pub size: f64,
    /// Half of by how much more ln of the likelihood is less by two.
    pub sigma: f64,
    /// ln of the likelihood at that size over that of none.
    pub log_ratio: f64,
}

/// Steps of a search in one variable.
const STEPS: usize = 40;

/// The size of columns of unit rms by their products seen through a model and their variances beforehand: of what is seen, by how much of
/// such a motion is seen on average, as what a model absorbs might have any size.
pub fn rms_size(
    gram: &DMatrix<f64>,
    gradient: &DVector<f64>,
    prior: &[f64],
) -> Option<SizeEvidence> {
    let seen: Vec<usize> = (0..prior.len()).filter(|k| prior[*k] > 0.0).collect();
    let count = seen.len();
    let before = DMatrix::from_fn(
        count,
        count,
        |i, j| {
            if i == j { prior[seen[i]] } else { 0.0 }
        },
    );
    let products = DMatrix::from_fn(count, count, |i, j| gram[(seen[i], seen[j])]);
    let mut precision = products.clone();
    (0..count).for_each(|i| precision[(i, i)] += 1.0 / prior[seen[i]]);
    let along = DVector::from_fn(count, |i, _| gradient[seen[i]]);
    let factor = precision.cholesky()?;
    let log_determinant: f64 = (0..count)
        .map(|i| 2.0 * factor.l_dirty()[(i, i)].ln() + prior[seen[i]].ln())
        .sum();
    let mean = factor.solve(&along);
    let log_evidence = 0.5 * (along.dot(&mean) - log_determinant);
    // Coordinates in which the square of the size is a sum of squares.
    let all: f64 = seen.iter().map(|k| prior[*k]).sum();
    let mean_seen = (before.component_mul(&products)).trace() / all;
    let jitter = DMatrix::from_diagonal_element(count, count, 1e-6);
    let root = (products / mean_seen + jitter).cholesky()?.l().transpose();
    let after = SymmetricEigen::new(&root * factor.inverse() * root.transpose());
    let after = Squares {
        variances: after.eigenvalues.as_slice().to_vec(),
        means: (after.eigenvectors.transpose() * (&root * mean))
            .as_slice()
            .to_vec(),
    };
    let before = SymmetricEigen::new(&root * before * root.transpose());
    let before = Squares {
        variances: before.eigenvalues.as_slice().to_vec(),
        means: vec![0.0; count],
    };
    let log =
        |size: f64| log_evidence + after.log_density(size * size) - before.log_density(size * size);
    let most = 2.0 * after.mean().sqrt();
    let at = |k: f64| most * 0.01f64.powf(1.0 - k / (STEPS - 1) as f64);
    let best = (0..STEPS).max_by(|a, b| log(at(*a as f64)).total_cmp(&log(at(*b as f64))))?;
    let (mut low, mut high) = (at(best as f64 - 1.0), at(best as f64 + 1.0));
    for _ in 0..STEPS {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if log(a) < log(b) { low = a } else { high = b }
    }
    let peak = (low + high) / 2.0;
    let (size, log_ratio) = match log(peak) {
        ratio if best > 0 && ratio > 0.0 => (peak, ratio),
        _ => (0.0, 0.0),
    };
    let (mut low, mut high) = (size.max(1e-6 * most), size.max(1e-6 * most) + 2.0 * most);
    for _ in 0..STEPS {
        let middle = (low + high) / 2.0;
        if log(middle) > log_ratio - 2.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(SizeEvidence {
        size,
        sigma: (high - size) / 2.0,
        log_ratio,
    })
}

/// A sum of squares of independent normal variables.
struct Squares {
    variances: Vec<f64>,
    means: Vec<f64>,
}

impl Squares {
    fn terms(&self) -> impl Iterator<Item = (f64, f64)> {
        let squares = self.means.iter().map(|mean| mean * mean);
        self.variances.iter().copied().zip(squares)
    }

    fn mean(&self) -> f64 {
        self.terms()
            .map(|(variance, square)| variance + square)
            .sum()
    }

    /// ln of its density by its saddle point.
    fn log_density(&self, at: f64) -> f64 {
        let widest = self.variances.iter().copied().fold(0.0, f64::max);
        let slope = |t: f64| -> f64 {
            let slope_by = |(variance, square): (f64, f64)| {
                let s = 1.0 - 2.0 * t * variance;
                variance / s + square / (s * s)
            };
            self.terms().map(slope_by).sum()
        };
        // 1 - 2 t times the widest variance, from hardly more than none.
        let point = |log: f64| (1.0 - log.exp()) / (2.0 * widest);
        let (mut low, mut high) = (-30.0, 30.0);
        for _ in 0..STEPS {
            let middle = (low + high) / 2.0;
            if slope(point(middle)) > at {
                low = middle;
            } else {
                high = middle;
            }
        }
        let t = point((low + high) / 2.0);
        let (mut cumulant, mut curvature) = (0.0, 0.0);
        for (variance, square) in self.terms() {
            let s = 1.0 - 2.0 * t * variance;
            cumulant += t * square / s - 0.5 * s.ln();
            curvature +=
                2.0 * variance * variance / (s * s) + 4.0 * variance * square / (s * s * s);
        }
        cumulant - t * at - 0.5 * (std::f64::consts::TAU * curvature).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln of the likelihood of a size of so many like columns, by hand.
    fn one_case(columns: usize, along: f64) -> SizeEvidence {
        let gram = DMatrix::from_diagonal_element(columns, columns, 4.0);
        let mut gradient = DVector::zeros(columns);
        gradient[columns - 1] = along;
        rms_size(&gram, &gradient, &vec![9.0; columns]).unwrap()
    }

    fn peak(log: impl Fn(f64) -> f64) -> (f64, f64) {
        let sizes = (0..2000).map(|k| 2e-3 * f64::from(k));
        let at_size = |size: f64| (size, log(size));
        sizes
            .map(at_size)
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap()
    }

    #[test]
    fn of_one_column_the_likelihood_is_that_of_either_sign() {
        for along in [0.5, 3.0, 8.0] {
            let by_hand = |size: f64| (along * size).cosh().ln() - 2.0 * size * size;
            let (size, log) = peak(by_hand);
            let found = one_case(1, along);
            assert!((found.size - size).abs() < 0.06, "{found:?} {size}");
            assert!((found.log_ratio - log).abs() < 0.2, "{found:?} {log}");
        }
    }

    #[test]
    fn of_two_columns_it_is_that_of_every_direction() {
        // I0 by its integral.
        let bessel = |x: f64| {
            let angles = (0..200).map(|k| std::f64::consts::TAU * f64::from(k) / 200.0);
            angles.map(|angle| (x * angle.cos()).exp()).sum::<f64>() / 200.0
        };
        for along in [1.0, 5.0, 9.0] {
            let by_hand = |size: f64| bessel(along * size).ln() - 2.0 * size * size;
            let (size, log) = peak(|size| if size < 3.0 { by_hand(size) } else { -9.0 });
            let found = one_case(2, along);
            assert!((found.size - size).abs() < 0.05, "{found:?} {size}");
            assert!((found.log_ratio - log).abs() < 0.15, "{found:?} {log}");
            let off = by_hand(found.size + 2.0 * found.sigma);
            assert!((log - off - 2.0).abs() < 0.3, "{found:?} {off}");
        }
    }

    #[test]
    fn what_no_row_shows_has_no_size() {
        let found = one_case(12, 0.1);
        assert!(found.size == 0.0 && found.log_ratio == 0.0, "{found:?}");
        assert!(found.sigma > 0.3 && found.sigma < 1.5, "{found:?}");
    }
}
