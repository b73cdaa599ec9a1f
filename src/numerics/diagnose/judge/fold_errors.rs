//! Errors of fitted rows under fits that did not see their pose, and whether they are smaller than those of another model.

use crate::criteria::judge::FOLDS;
use crate::diagnose::round::{FitState, Fitter};
use crate::estimate::{FoldKind, Session, dealt, gather};
use std::collections::BTreeMap;

/// Rows of the folds that judge a state; the same for every model that is compared. `None` where the poses are too few.
pub(super) fn folds(now: &FitState, fitter: &Fitter) -> Option<Vec<Vec<usize>>> {
    dealt(kind(fitter), &now.session(fitter), *FOLDS)
}

/// Where noise is correlated, a row is known by its neighbours in time: whole stretches are left out.
fn kind(fitter: &Fitter) -> FoldKind {
    if fitter.correlated.is_some() {
        FoldKind::Blocks
    } else {
        FoldKind::Random(fitter.question.seed)
    }
}

/// Errors of the rows that were fitted.
pub(crate) struct FoldErrors {
    /// Squared errors, m2 or rad2, by row.
    squares: BTreeMap<usize, f64>,
}

impl FoldErrors {
    /// `None` where the poses are too few for folds.
    pub(crate) fn of(now: &FitState, fitter: &Fitter) -> Option<Self> {
        let session = now.session(fitter);
        let folds = folds(now, fitter)?;
        Some(Self::gathered(
            &session,
            &folds,
            &session.without_each(&folds, fitter.scale),
        ))
    }

    /// From the errors of each fold's rows.
    pub(crate) fn gathered(session: &Session, folds: &[Vec<usize>], errors: &[Vec<f64>]) -> Self {
        let errors = gather(session.data, session.rows, folds, errors);
        let squares = session
            .rows
            .iter()
            .zip(errors)
            .map(|(row, error)| (*row, error * error))
            .collect();
        Self { squares }
    }

    pub(crate) fn rms(&self) -> f64 {
        (self.squares.values().sum::<f64>() / self.squares.len() as f64).sqrt()
    }
}
