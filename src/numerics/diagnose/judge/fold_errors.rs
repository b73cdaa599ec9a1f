//! Errors of fitted rows under fits that did not see their pose, and whether they are smaller than those of another model.

use crate::criteria::judge::{CLEARLY, FOLDS, WORSE};
use crate::diagnose::round::{FitState, Fitter};
use crate::effect::Place;
use crate::estimate::{ErrorScale, FoldKind, Session, autocorrelation_time, dealt, gather};
use std::collections::BTreeMap;

/// Causes of one effect and place, and what the rms (m) of the folds falls by with them.
#[derive(Debug, Clone)]
pub(crate) struct FoldGain {
    pub effect: &'static str,
    pub place: Place,
    pub gain: f64,
}

/// Rows of the folds that judge a state; the same for every model that is compared. `None` where the poses are too few.
pub(super) fn folds(now: &FitState, fitter: &Fitter) -> Option<Vec<Vec<usize>>> {
    dealt(kind(fitter), &now.session(fitter), *FOLDS)
}

/// The same where each fold is a stretch of the recording.
pub(super) fn stretches(now: &FitState, fitter: &Fitter) -> Option<Vec<Vec<usize>>> {
    dealt(FoldKind::Blocks, &now.session(fitter), *FOLDS)
}

/// Where noise is correlated, a row is known by its neighbours in time: whole stretches are left out.
fn kind(fitter: &Fitter) -> FoldKind {
    if fitter.correlated.is_some() { FoldKind::Blocks } else { FoldKind::Random(fitter.question.seed) }
}

/// Errors of the rows that were fitted.
pub(crate) struct FoldErrors {
    /// Squared errors, m2 or rad2, by row.
    squares: BTreeMap<usize, f64>,
    /// What they are told in.
    scale: ErrorScale,
    /// Whether they lie along a path.
    moving: bool,
}

impl FoldErrors {
    /// `None` where the poses are too few for folds.
    pub fn of(now: &FitState, fitter: &Fitter) -> Option<Self> {
        Self::of_folds(kind(fitter), now, fitter)
    }

    /// Where each fold is a stretch of the recording, the first and the last among them. `None` where the poses are too few.
    pub fn of_stretches(now: &FitState, fitter: &Fitter) -> Option<Self> {
        Self::of_folds(FoldKind::Blocks, now, fitter)
    }

    fn of_folds(kind: FoldKind, now: &FitState, fitter: &Fitter) -> Option<Self> {
        let session = now.session(fitter);
        let folds = dealt(kind, &session, *FOLDS)?;
        Some(Self::gathered(&session, &folds, &session.without_each(&folds, fitter.scale), fitter.scale))
    }

    /// From the errors of each fold's rows.
    pub fn gathered(session: &Session, folds: &[Vec<usize>], errors: &[Vec<f64>], scale: ErrorScale) -> Self {
        let errors = gather(session.data, session.rows, folds, errors);
        let squares = session.rows.iter().zip(errors).map(|(row, error)| (*row, error * error)).collect();
        Self { squares, scale, moving: session.data.in_motion(session.rows) }
    }

    pub fn rms(&self) -> f64 {
        (self.squares.values().sum::<f64>() / self.squares.len() as f64).sqrt()
    }

    /// By how much the rms of this is smaller than that of `other`, at the rows that both were fitted to.
    pub fn gain_over(&self, other: &Self) -> f64 {
        let [own, theirs] = self.rms_beside(other);
        theirs - own
    }

    /// -2 ln of the odds of `other` against this, by these rows.
    pub fn evidence_against(&self, other: &Self) -> f64 {
        let [own, theirs] = self.rms_beside(other);
        2.0 * self.scale.values() * self.squares.len() as f64 * (theirs / own).ln()
    }

    /// Whether this is better than `other` by a share that matters, and by more than the rows' scatter would have it.
    pub fn is_better_than(&self, other: &Self) -> bool {
        let [own, theirs] = self.rms_beside(other);
        own < theirs * (1.0 - *WORSE) && self.fall_from(other) > *CLEARLY
    }

    /// Whether this is so much better than `other` at the first or at the last of the stretches, beyond which programs and later rows lie.
    pub fn is_better_at_an_end_than(&self, other: &Self) -> bool {
        let rows: Vec<usize> = self.squares.keys().copied().collect();
        let length = rows.len().div_ceil(*FOLDS);
        let within = |ends: &[usize]| {
            let (Some(first), Some(last)) = (ends.first(), ends.last()) else { return false };
            let part = |errors: &Self| Self {
                squares: errors.squares.range(*first..=*last).map(|(row, square)| (*row, *square)).collect(),
                ..*errors
            };
            part(self).is_better_than(&part(other))
        };
        within(&rows[..length.min(rows.len())]) || within(&rows[rows.len().saturating_sub(length)..])
    }

    /// The rms of both at the rows that both were fitted to.
    fn rms_beside(&self, other: &Self) -> [f64; 2] {
        let both = self.squares.iter().filter_map(|(row, own)| Some((own, other.squares.get(row)?)));
        let (own, theirs, count) = both.fold((0.0, 0.0, 0), |(a, b, n), (own, theirs)| (a + own, b + theirs, n + 1));
        [own, theirs].map(|sum| (sum / f64::from(count.max(1))).sqrt())
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
