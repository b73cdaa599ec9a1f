//! Folds of the rows to fit: how well poses are predicted by a fit that did not see them. Rows that are held out for validation take no part.

use crate::criteria::judge::{CLEARLY, FOLDS};
use crate::estimate::{FoldKind, NearbyFits, Session, dealt, gather};
use crate::linear::mean_square;
use crate::round::{EstimatedCause, FitState, Fitter, with_causes};
use std::ops::Range;

/// Fits around a state, in a linear picture: with causes left out, and rivals that may come in.
pub(crate) struct Alternatives<'n> {
    state: &'n FitState,
    session: Session<'n>,
    /// Where the parameters of the causes are, then those of the rivals.
    ranges: &'n [Range<usize>],
    folds: &'n [Vec<usize>],
    columns: &'n [usize],
    nearby: NearbyFits<'n>,
}

impl Alternatives<'_> {
    /// Asks the fits around a state with some rivals at zero; `None` where the poses are too few for folds, or bounds are in the way.
    pub(crate) fn ask<T>(
        state: &FitState,
        fitter: &Fitter,
        rivals: &[EstimatedCause],
        ask: impl FnOnce(&Alternatives) -> T,
    ) -> Option<T> {
        let at_zero = |cause: &EstimatedCause| EstimatedCause {
            coefficients: vec![0.0; cause.coefficients.len()],
            ..cause.clone()
        };
        let mut causes = state.causes.clone();
        causes.extend(rivals.iter().map(at_zero));
        let (model, ranges) = with_causes(&state.model, &causes);
        let folds = folds(state, fitter)?;
        let session = Session {
            model: &model,
            ..state.session(fitter)
        };
        let mut columns = state.fitted.free();
        columns.extend(ranges[state.causes.len()..].iter().cloned().flatten());
        let nearby = NearbyFits::of(&session, &folds, &columns, fitter.scale)?;
        Some(ask(&Alternatives {
            state,
            session,
            ranges: &ranges,
            folds: &folds,
            columns: &columns,
            nearby,
        }))
    }

    /// Steps without some causes (by their positions), and all rivals but one (by its own).
    fn steps(&self, out: &[usize], rival: Option<usize>) -> Vec<Option<f64>> {
        let causes = self.state.causes.len();
        let left_out = |k: &usize| out.iter().any(|i| self.ranges[*i].contains(k));
        let other = |k: &usize| {
            let mut rivals = self.ranges[causes..].iter().enumerate();
            rivals.any(|(i, range)| range.contains(k) && rival != Some(i))
        };
        let step = |k: &usize| (left_out(k) || other(k)).then_some(-self.session.model.x[*k]);
        self.columns.iter().map(step).collect()
    }

    /// The rms error of folds without some causes (by their positions), and with a rival (by its own) or none. Nothing where that is not near
    /// the state.
    pub(crate) fn error(&self, out: &[usize], rival: Option<usize>) -> Option<f64> {
        let errors = self.nearby.with(&self.steps(out, rival))?;
        let errors: Option<Vec<Vec<f64>>> = errors.into_iter().collect();
        Some(rms(&self.session, self.folds, &errors?))
    }

    /// The coefficients of a rival (by its position) in the place of some causes, with their standard deviations, SI.
    pub(crate) fn coefficients(&self, out: &[usize], rival: usize) -> Option<Vec<(f64, f64)>> {
        let columns = self.ranges[self.state.causes.len() + rival].clone();
        let steps = self.steps(out, Some(rival));
        let found = self
            .nearby
            .estimated(&steps, &columns.collect::<Vec<_>>())?;
        let scale = self.state.fitted.noise_scale;
        let found = found.into_iter();
        Some(found.map(|(value, sigma)| (value, sigma * scale)).collect())
    }
}

/// Rows of the folds that judge a state; the same for every model that is compared. `None` where the poses are too few.
fn folds(now: &FitState, fitter: &Fitter) -> Option<Vec<Vec<usize>>> {
    // Where noise is correlated or rows follow a path, a row is known by its neighbours: whole stretches are left out.
    let kind = match fitter.correlated.is_some() || fitter.dense {
        true => FoldKind::Blocks,
        false => FoldKind::Random(fitter.question.seed),
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

/// Causes of findings that stretches of a path do not confirm: taken out one finding after the other, the worst first, while the stretches are
/// not predicted clearly better with it, and all where that is so of those that stay together; none where rows follow no path.
pub(crate) fn unconfirmed(state: &FitState, found: &[Vec<usize>], fitter: &Fitter) -> Vec<usize> {
    let stretches = || fitter.dense.then(|| folds(state, fitter)).flatten();
    let Some(folds) = stretches() else {
        return Vec::new();
    };
    // Mean squared error of each stretch without some causes.
    let without = |out: &[usize]| -> Vec<f64> {
        let kept = (0..state.causes.len()).filter(|i| !out.contains(i));
        let kept = kept.map(|i| state.causes[i].clone()).collect();
        let fit = fitter.fit(&state.model, kept);
        let errors = fit.session(fitter).without_each(&folds, fitter.scale);
        errors.iter().map(|fold| mean_square(fold)).collect()
    };
    let mut out: Vec<usize> = Vec::new();
    let mut now = without(&out);
    let mut left: Vec<&Vec<usize>> = found.iter().collect();
    loop {
        let errors = left
            .iter()
            .map(|members| without(&[&out[..], members].concat()));
        let mean = |errors: &[f64]| errors.iter().sum::<f64>();
        let best = errors
            .enumerate()
            .min_by(|a, b| mean(&a.1).total_cmp(&mean(&b.1)));
        match best.filter(|(_, errors)| !is_clearly_less(&now, errors)) {
            Some((at, errors)) => {
                now = errors;
                out.extend(left.remove(at));
            }
            None => break,
        }
    }
    let all = found.concat();
    match left.len() > 1 && !is_clearly_less(&now, &without(&all)) {
        true => all,
        false => out,
    }
}

/// Whether some mean squares are less than others: ln of their ratios by more than twice the standard error of its mean, as an effect may be
/// strong in one stretch and weak in another.
fn is_clearly_less(some: &[f64], others: &[f64]) -> bool {
    let pairs = some.iter().zip(others);
    let gains: Vec<f64> = pairs.map(|(some, other)| (other / some).ln()).collect();
    let count = gains.len().max(2) as f64;
    let mean = gains.iter().sum::<f64>() / count;
    let scatter = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (count - 1.0);
    mean > *CLEARLY * (scatter / count).sqrt()
}

/// From the errors of each fold's rows.
fn rms(session: &Session, folds: &[Vec<usize>], errors: &[Vec<f64>]) -> f64 {
    let errors = gather(session.data, session.rows, folds, errors);
    let squares = errors.iter().map(|error| error * error);
    (squares.sum::<f64>() / errors.len() as f64).sqrt()
}
