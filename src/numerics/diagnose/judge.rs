//! Folds of the rows to fit: how well poses are predicted by a fit that did not see them. Rows that are held out for validation take no part.
//!
//! Models with causes left out or with another one, judged by folds of the rows in a linear picture: an effect is small, so that its
//! coefficients change the points in proportion. What is to change the model is fitted afterwards.

use crate::criteria::judge::FOLDS;
use crate::estimate::{FoldKind, Model, NearbyFits, Session, dealt, gather};
use crate::round::{EstimatedCause, FitState, Fitter, with_causes};
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
        let mut causes = state.causes.clone();
        causes.extend(rivals.iter().map(at_zero));
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

    /// The rms error of folds without some causes (by their positions), and with a rival (by its own) or none. Nothing where that is not near
    /// the state.
    pub(crate) fn error(&self, out: &[usize], rival: Option<usize>) -> Option<f64> {
        let errors = self.nearby.with(&self.steps(out, rival))?;
        let errors: Option<Vec<Vec<f64>>> = errors.into_iter().collect();
        Some(rms(&self.session, &self.alternatives.folds, &errors?))
    }

    /// The coefficients of a rival (by its position) in the place of some causes, with their standard deviations, SI.
    pub(crate) fn coefficients(&self, out: &[usize], rival: usize) -> Option<Vec<(f64, f64)>> {
        let Alternatives { state, ranges, .. } = self.alternatives;
        let columns: Vec<usize> = ranges[state.causes.len() + rival].clone().collect();
        let steps = self.steps(out, Some(rival));
        let found = self.nearby.estimated(&steps, &columns)?.into_iter();
        let scale = state.fitted.noise_scale;
        Some(found.map(|(value, sigma)| (value, sigma * scale)).collect())
    }
}

/// Rows of the folds that judge a state; the same for every model that is compared. `None` where the poses are too few.
fn folds(now: &FitState, fitter: &Fitter) -> Option<Vec<Vec<usize>>> {
    // Where noise is correlated, a row is known by its neighbours in time: whole stretches are left out.
    let kind = match fitter.correlated {
        Some(_) => FoldKind::Blocks,
        None => FoldKind::Random(fitter.question.seed),
    };
    dealt(kind, &now.session(fitter), *FOLDS)
}

/// Rms error of the fitted rows under fits that did not see their pose; `None` where the poses are too few for folds.
pub(crate) fn fold_error(now: &FitState, fitter: &Fitter) -> Option<f64> {
    let session = now.session(fitter);
    let folds = folds(now, fitter)?;
    let errors = session.without_each(&folds, fitter.scale);
    Some(rms(&session, &folds, &errors))
}

/// From the errors of each fold's rows.
fn rms(session: &Session, folds: &[Vec<usize>], errors: &[Vec<f64>]) -> f64 {
    let errors = gather(session.data, session.rows, folds, errors);
    let squares = errors.iter().map(|error| error * error);
    (squares.sum::<f64>() / errors.len() as f64).sqrt()
}
