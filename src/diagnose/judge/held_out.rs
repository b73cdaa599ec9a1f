//! Errors of a fit on held-out rows, and whether they are smaller than those of another fit.

use crate::diagnose::round::{FitState, Fitter};
use crate::effect::Place;
use crate::estimate::autocorrelation_time;
use std::collections::BTreeMap;

/// Causes of one effect and place, and what the held-out rms (m) falls by with them.
#[derive(Debug, Clone)]
pub(crate) struct HoldoutGain {
    pub effect: &'static str,
    pub place: Place,
    pub gain: f64,
}

/// A model that is worse on held-out rows by this share, and by so many standard errors, is worse.
const WORSE: f64 = 0.03;
const CLEARLY: f64 = 2.0;
/// Without a share that matters it takes more: every finding is asked.
const BEYOND_DOUBT: f64 = 3.0;

/// Errors at held-out rows that belong.
pub(super) struct HeldOutErrors {
    /// Squared errors, m2, by row.
    squares: BTreeMap<usize, f64>,
    /// Whether they lie along a path.
    moving: bool,
}

impl HeldOutErrors {
    /// `None` where no row is held out.
    pub fn of(now: &FitState, fitter: &Fitter) -> Option<Self> {
        let (data, validate) = (&fitter.data, fitter.question.validate);
        let aside = |row: &usize| now.screening.suspects.iter().any(|s| s.row == *row && !s.used());
        let predicted = now.model.predict(data);
        let rows = validate.iter().filter(|row| !aside(row));
        let squares: BTreeMap<usize, f64> =
            rows.map(|row| (*row, (data.position[*row] - predicted[*row]).norm_squared())).collect();
        (!squares.is_empty()).then(|| Self { squares, moving: data.in_motion(validate) })
    }

    pub fn rms(&self) -> f64 {
        (self.squares.values().sum::<f64>() / self.squares.len() as f64).sqrt()
    }

    /// -2 ln of the odds of `other` against this, by these rows.
    pub fn evidence_against(&self, other: &Self) -> f64 {
        2.0 * 3.0 * self.squares.len() as f64 * (other.rms() / self.rms()).ln()
    }

    /// Whether this is better than `other` by a share that matters, and by more than the rows' scatter would have it.
    pub fn is_better_than(&self, other: &Self) -> bool {
        self.rms() < other.rms() * (1.0 - WORSE) && self.fall_from(other) > CLEARLY
    }

    /// Whether this is better than `other`, by however little, beyond what the rows' scatter would have.
    pub fn is_beyond_doubt_better_than(&self, other: &Self) -> bool {
        self.fall_from(other) > BEYOND_DOUBT
    }

    /// By how many standard errors squared errors are smaller than those of `other`.
    fn fall_from(&self, other: &Self) -> f64 {
        let falls: Vec<f64> = self.squares.iter().filter_map(|(row, own)| Some(other.squares.get(row)? - own)).collect();
        let count = falls.len() as f64;
        let mean = falls.iter().sum::<f64>() / count;
        let variance = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
        // Rows along a path are not as many opinions as there are rows.
        let off: Vec<f64> = falls.iter().map(|fall| fall - mean).collect();
        let count = if self.moving { count / autocorrelation_time(&off, 1) } else { count };
        let error = (variance / count).sqrt();
        if error.is_nan() { 0.0 } else { mean / error.max(f64::MIN_POSITIVE) }
    }
}
