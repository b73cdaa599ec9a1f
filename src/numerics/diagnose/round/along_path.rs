//! Rows along a path: each pose is near the one before it, so that what changes with the pose looks like noise that is correlated in time.

use crate::criteria::noise::NEAR;
use crate::diagnose::whitened::AutocorrelatedNoise;
use crate::robot::Measurements;
use crate::statistics::nearest;

/// How far correlation on a path has been looked into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PathCorrelation {
    /// Nothing looks correlated so far.
    Unasked,
    /// Causes that do not follow time are searched by themselves, against white noise.
    CausesFirst,
    /// Noise and those causes were compared.
    Decided,
}

/// What noise does from row to row, and what becomes of the causes that were found without it.
pub(crate) struct CorrelationChange {
    /// None where it is white.
    pub(crate) noise: Option<AutocorrelatedNoise>,
    /// Whether causes that do not follow time explain more than such noise would.
    pub(crate) keeps_causes: bool,
}

/// Whether neighbours in time are neighbours in pose.
pub(super) fn follow_a_path(data: &Measurements, rows: &[usize]) -> bool {
    let mut measured: Vec<usize> = rows.to_vec();
    measured.sort_by_key(|row| data.rank_in_time(*row));
    let apart = |a: usize, b: usize| {
        data.q(a)
            .iter()
            .zip(data.q(b))
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let mut steps: Vec<f64> = measured
        .windows(2)
        .map(|pair| apart(pair[0], pair[1]))
        .filter(|step| *step > 0.0)
        .collect();
    // Rows half of the recording apart stand for any two.
    let half = measured.len() / 2;
    let mut any: Vec<f64> = measured
        .iter()
        .zip(&measured[half..])
        .map(|(a, b)| apart(*a, *b))
        .collect();
    match (nearest(&mut steps, 0.5), nearest(&mut any, 0.5)) {
        (Some(step), Some(any)) => step < *NEAR * any,
        _ => false,
    }
}
