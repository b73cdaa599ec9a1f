//! What the data can see: which parameters are redundant or unseen, rank, condition and observability indices O1-O5.
//!
//! Parameters are taken in order of precedence; one whose effect lies in the span of those before it stays at its nominal
//! value and says with whom it is redundant. Indices after Sun and Hollerbach, ICRA 2008.

use super::factor::TriangularFactor;
use crate::estimate::factor::{axpy, dot, norm as length};

/// How a candidate parameter was classed.
#[derive(Debug, Clone, PartialEq)]
pub enum Visibility {
    /// The data determine it.
    Seen,
    /// Others do the same; with the names' positions and their share, strongest first.
    Redundant(Vec<(usize, f64)>),
    /// The data do not tell it from noise even at its largest plausible value.
    Unseen,
}

/// Orthogonal rest (relative) below which a column is a combination of others: rounding leaves 1e-12, real designs 1e-4.
const RANK_TOLERANCE: f64 = 1e-8;

/// Decides for the candidates (columns of `factor`, whitened; in order of precedence) which are seen.
pub(crate) fn visibility(factor: &TriangularFactor, prior_sigma: &[f64]) -> Vec<Visibility> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut kept: Vec<usize> = Vec::new();
    // Upper triangular coefficients of the kept columns in the basis.
    let mut triangle: Vec<Vec<f64>> = Vec::new();
    let mut out = Vec::with_capacity(prior_sigma.len());
    for (j, prior) in prior_sigma.iter().enumerate() {
        let column = factor.column(j);
        let norm = length(column);
        if norm * prior < 1.0 {
            out.push(Visibility::Unseen);
            continue;
        }
        let mut residual = column.to_vec();
        let mut shares = vec![0.0; basis.len()];
        // Twice is enough: classical result on Gram-Schmidt with one reorthogonalisation.
        for _ in 0..2 {
            for (share, direction) in shares.iter_mut().zip(&basis) {
                // Columns are as long as they are far from the first.
                let along = dot(&residual, direction);
                *share += along;
                axpy(-along, direction, &mut residual);
            }
        }
        let left = length(&residual);
        if left < RANK_TOLERANCE * norm || left * prior < 1.0 {
            out.push(Visibility::Redundant(combination(
                &triangle, &kept, &shares, factor, norm,
            )));
            continue;
        }
        for value in &mut residual {
            *value /= left;
        }
        basis.push(residual);
        shares.push(left);
        triangle.push(shares);
        kept.push(j);
        out.push(Visibility::Seen);
    }
    out
}

/// Which kept columns make up a redundant one: those with at least a tenth of its norm.
fn combination(
    triangle: &[Vec<f64>],
    kept: &[usize],
    shares: &[f64],
    factor: &TriangularFactor,
    norm: f64,
) -> Vec<(usize, f64)> {
    let n = shares.len();
    let mut coefficients = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| triangle[k][i] * coefficients[k]).sum();
        coefficients[i] = (shares[i] - known) / triangle[i][i];
    }
    let mut parts: Vec<(usize, f64)> = coefficients
        .iter()
        .zip(kept)
        .map(|(coefficient, j)| (*j, coefficient.abs() * factor.column_norm(*j) / norm))
        .filter(|(_, share)| *share >= 0.1)
        .collect();
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    parts
}

/// Condition and observability indices of singular values (largest first) from `rows` measured points.
pub(crate) fn indices(singular: &[f64], rows: usize) -> Vec<(&'static str, f64, &'static str)> {
    let (Some(first), Some(last)) = (singular.first(), singular.last()) else {
        return Vec::new();
    };
    let p = singular.len() as f64;
    let root = (rows as f64).sqrt();
    let mean_log = singular.iter().map(|s| s.ln()).sum::<f64>() / p;
    let inverse: f64 = singular.iter().map(|s| 1.0 / s).sum();
    vec![
        (
            "condition",
            first / last,
            "largest over smallest singular value, columns scaled to unit prior sigma",
        ),
        (
            "O1",
            mean_log.exp() / root,
            "geometric mean of the singular values over root of points: size of the whole ellipsoid (D-optimality)",
        ),
        ("O2", last / first, "inverse condition number: roundness"),
        (
            "O3",
            *last,
            "smallest singular value: the worst seen direction (E-optimality)",
        ),
        ("O4", last * last / first, "noise amplification index"),
        (
            "O5",
            1.0 / inverse,
            "harmonic mean over p of the singular values (A-optimality)",
        ),
    ]
}
