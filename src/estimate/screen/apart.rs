//! Stretches of a recording whose joints and points are rows apart: plain to see before anything is fitted, and fatal to a fit.
//!
//! A rigid motion brings the nominal robot's points of a stretch onto the measured ones, but for the errors of a nominal robot;
//! where it does so only with the joints of rows further on, the two logs have slipped.

use crate::estimate::align::kabsch;
use crate::robot::Measurements;
use nalgebra::Vector3;

/// Rows of a stretch, enough for six numbers and a judgement.
const STRETCH: usize = 20;
/// Stretches begin so many rows apart: they overlap, so that few rows beside the place where the logs slip go unseen.
const STEP: usize = 4;
/// Most rows that are tried either way.
const MOST: i64 = 64;
/// A nominal robot leaves less than this share of the size of a stretch.
const NOMINAL: f64 = 0.03;
/// With the right joints so many times less is left.
const BETTER: f64 = 5.0;

/// For every row how many rows further on its joints are, where that is plain; zero elsewhere.
pub(super) fn apart(data: &Measurements, predicted: &[Vector3<f64>]) -> Vec<i64> {
    let mut out = vec![0; predicted.len()];
    for first in (0..predicted.len()).step_by(STEP) {
        let last = (first + STRETCH).min(predicted.len());
        let rows = last.saturating_sub(STRETCH)..last;
        let own = left(data, predicted, rows.clone(), 0);
        let Some(own) = own.filter(|own| *own > NOMINAL) else { continue };
        let tried = (1..=MOST).flat_map(|k| [k, -k]);
        let tried = tried.filter_map(|k| left(data, predicted, rows.clone(), k).map(|left| (left, k)));
        if let Some((left, offset)) = tried.min_by(|a, b| a.0.total_cmp(&b.0))
            && left < NOMINAL
            && BETTER * left < own
        {
            out[first..last].fill(offset);
        }
    }
    out
}

/// Rms distance after the best rigid motion as a share of the stretch's size; `None` where too few rows have both.
fn left(data: &Measurements, predicted: &[Vector3<f64>], rows: std::ops::Range<usize>, offset: i64) -> Option<f64> {
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = rows
        .filter(|row| data.whole(*row))
        .filter_map(|row| {
            let there = usize::try_from(row as i64 + offset).ok()?;
            Some((*predicted.get(there)?, data.position[row]))
        })
        .collect();
    if 2 * pairs.len() < STRETCH {
        return None;
    }
    let (from, to): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
    let all: Vec<usize> = (0..from.len()).collect();
    let motion = kabsch(&from, &to, &all);
    let count = from.len() as f64;
    let centre = to.iter().sum::<Vector3<f64>>() / count;
    let size = to.iter().map(|point| (point - centre).norm_squared()).sum::<f64>();
    let rest = from.iter().zip(&to).map(|(a, b)| (motion.point(a) - b).norm_squared()).sum::<f64>();
    (size > 0.0).then(|| (rest / size).sqrt())
}
