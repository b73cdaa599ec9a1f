//! Folds of the rows to fit: how well poses are predicted by a fit that did not see them. Rows that are held out for validation take no part.
//!
//! Models with causes left out or with another one, judged by folds of the rows in a linear picture: an effect is small, so that its
//! coefficients change the points in proportion. What is to change the model is fitted afterwards.
//!
//! Errors of fitted rows under fits that did not see their pose, and whether they are smaller than those of another model.

use crate::criteria::judge::FOLDS;
use crate::estimate::{FoldKind, Model, NearbyFits, Session, dealt, gather};
use crate::round::{EstimatedCause, FitState, Fitter, with_causes};
use std::collections::BTreeMap;
use std::ops::Range;

/// A fitted state of which causes are left out, and rivals that may come in.
pub(crate) struct Alternatives<'a> {
    state: &'a FitState,
    fitter: &'a Fitter<'a>,
    /// The state's model with the rivals at zero.
    model: Model,
    /// Where the parameters of the causes are, then those of the rivals.
    ranges: Vec<Range<usize>>,
    folds: Vec<Vec<usize>>,
}

impl<'a> Alternatives<'a> {
    /// `None` where the poses are too few for folds.
    pub(crate) fn of(
        state: &'a FitState,
        fitter: &'a Fitter,
        rivals: &[EstimatedCause],
    ) -> Option<Self> {
        let at_zero = |cause: &EstimatedCause| EstimatedCause {
            coefficients: vec![0.0; cause.coefficients.len()],
            ..cause.clone()
        };
        let causes: Vec<EstimatedCause> = state
            .causes
            .iter()
            .cloned()
            .chain(rivals.iter().map(at_zero))
            .collect();
        let (model, ranges) = with_causes(&state.model, &causes);
        Some(Self {
            state,
            fitter,
            model,
            ranges,
            folds: folds(state, fitter)?,
        })
    }

    /// The fits around the state; none where bounds are in the way.
    pub(crate) fn near(&self) -> Option<NearAlternatives<'_>> {
        let Self {
            state,
            fitter,
            model,
            ranges,
            folds,
        } = self;
        let session = Session {
            model,
            ..state.session(fitter)
        };
        let mut columns = state.fitted.free();
        columns.extend(ranges[state.causes.len()..].iter().cloned().flatten());
        let nearby = NearbyFits::of(&session, folds, &columns, fitter.scale)?;
        Some(NearAlternatives {
            alternatives: self,
            session,
            columns,
            nearby,
        })
    }
}

/// Fits around a state, in a linear picture.
pub(crate) struct NearAlternatives<'n> {
    alternatives: &'n Alternatives<'n>,
    session: Session<'n>,
    columns: Vec<usize>,
    nearby: NearbyFits<'n>,
}

impl NearAlternatives<'_> {
    /// Steps without some causes (by their positions), and all rivals but one (by its own).
    fn steps(&self, out: &[usize], rival: Option<usize>) -> Vec<Option<f64>> {
        let Alternatives {
            state,
            model,
            ranges,
            ..
        } = self.alternatives;
        let causes = state.causes.len();
        let left_out = |k: &usize| out.iter().any(|i| ranges[*i].contains(k));
        let other = |k: &usize| {
            (causes..ranges.len()).any(|i| ranges[i].contains(k) && rival != Some(i - causes))
        };
        self.columns
            .iter()
            .map(|k| (left_out(k) || other(k)).then_some(-model.x[*k]))
            .collect()
    }

    /// The errors of folds without some causes (by their positions), and with a rival (by its own) or none. Nothing where that is not near
    /// the state.
    pub(crate) fn errors(&self, out: &[usize], rival: Option<usize>) -> Option<FoldErrors> {
        let errors: Option<Vec<Vec<f64>>> = self
            .nearby
            .with(&self.steps(out, rival))?
            .into_iter()
            .collect();
        Some(FoldErrors::gathered(
            &self.session,
            &self.alternatives.folds,
            &errors?,
        ))
    }

    /// The coefficients of a rival (by its position) in the place of some causes, with their standard deviations, SI.
    pub(crate) fn coefficients(&self, out: &[usize], rival: usize) -> Option<Vec<(f64, f64)>> {
        let Alternatives { state, ranges, .. } = self.alternatives;
        let columns: Vec<usize> = ranges[state.causes.len() + rival].clone().collect();
        let found = self
            .nearby
            .estimated(&self.steps(out, Some(rival)), &columns)?;
        let scale = state.fitted.noise_scale;
        Some(
            found
                .into_iter()
                .map(|(value, sigma)| (value, sigma * scale))
                .collect(),
        )
    }
}

/// Rows of the folds that judge a state; the same for every model that is compared. `None` where the poses are too few.
pub(crate) fn folds(now: &FitState, fitter: &Fitter) -> Option<Vec<Vec<usize>>> {
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
