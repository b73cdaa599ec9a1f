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
            of: self,
            session,
            columns,
            nearby,
        })
    }
}

/// Fits around a state, in a linear picture.
pub(crate) struct NearAlternatives<'n> {
    of: &'n Alternatives<'n>,
    session: Session<'n>,
    columns: Vec<usize>,
    nearby: NearbyFits<'n>,
}

impl NearAlternatives<'_> {
    /// Steps of what is left out: some causes (by their positions), and all rivals but one (by its own).
    fn steps(&self, out: &[usize], rival: Option<usize>) -> Vec<Option<f64>> {
        let Alternatives {
            state,
            model,
            ranges,
            ..
        } = self.of;
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
            &self.of.folds,
            &errors?,
        ))
    }

    /// The coefficients of a rival (by its position) in the place of some causes, with their standard deviations, SI.
    pub(crate) fn coefficients(&self, out: &[usize], rival: usize) -> Option<Vec<(f64, f64)>> {
        let Alternatives { state, ranges, .. } = self.of;
        let own: Vec<usize> = ranges[state.causes.len() + rival].clone().collect();
        let found = self.nearby.estimated(&self.steps(out, Some(rival)), &own)?;
        let scale = state.fitted.noise_scale;
        Some(
            found
                .into_iter()
                .map(|(value, sigma)| (value, sigma * scale))
                .collect(),
        )
    }
}
