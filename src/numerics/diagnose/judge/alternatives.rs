//! Models with causes left out or with another one, judged by folds of the rows in a linear picture: an effect is small, so that its
//! coefficients change the points in proportion. What is to change the model is fitted afterwards.

use super::fold_errors::{FoldErrors, folds};
use crate::diagnose::round::{EstimatedCause, FitState, Fitter, with_causes};
use crate::estimate::{Model, NearbyFits, Session};
use std::ops::Range;

/// A fitted state beside which causes are left out, and rivals that may come in.
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
    pub fn of(state: &'a FitState, fitter: &'a Fitter, rivals: &[EstimatedCause]) -> Option<Self> {
        let at_zero =
            |cause: &EstimatedCause| EstimatedCause { coefficients: vec![0.0; cause.coefficients.len()], ..cause.clone() };
        let causes: Vec<EstimatedCause> = state.causes.iter().cloned().chain(rivals.iter().map(at_zero)).collect();
        let (model, ranges) = with_causes(&state.model, &causes);
        Some(Self { state, fitter, model, ranges, folds: folds(state, fitter)? })
    }

    /// What gives the errors of folds without some causes (by their positions), and with a rival (by its own) or none. It gives nothing
    /// where an alternative is not near the state.
    pub fn judge(&self) -> Option<impl Fn(&[usize], Option<usize>) -> Option<FoldErrors>> {
        let Self { state, fitter, model, ranges, folds } = self;
        let session = Session { model, ..state.session(fitter) };
        let causes = state.causes.len();
        let mut columns = state.fitted.free();
        columns.extend(ranges[causes..].iter().cloned().flatten());
        let nearby = NearbyFits::of(&session, folds, &columns, fitter.scale)?;
        Some(move |out: &[usize], rival: Option<usize>| {
            let left_out = |k: &usize| out.iter().any(|i| ranges[*i].contains(k));
            let other = |k: &usize| (causes..ranges.len()).any(|i| ranges[i].contains(k) && rival != Some(i - causes));
            let step = |k: &usize| (left_out(k) || other(k)).then_some(-model.x[*k]);
            let steps: Vec<Option<f64>> = columns.iter().map(step).collect();
            let errors: Option<Vec<Vec<f64>>> = nearby.with(&steps)?.into_iter().collect();
            Some(FoldErrors::gathered(&session, folds, &errors?, fitter.scale))
        })
    }
}
