//! Coefficients of one size: where rows determine some combinations of them and not others, those that they do determine say how large
//! the others may be (empirical Bayes).
//!
//! With the data's information P and vector b about the coefficients c, everything else fitted beside them, and c ~ N(0, s^2 I), the
//! logarithm of the evidence is half the sum over eigenvalues p of P of b^2 / (p + 1/s^2) - ln(1 + s^2 p).

use super::fit_state::{EstimatedCause, FitState, Fitter};
use crate::criteria::noise::{AGAINST, FITS, LEAST_SHARE, SHOWN};
use crate::estimate::{Covariance, Model, ParameterStatus, Prior};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The size is searched from the plausible one downwards over so many e-folds, in so many steps.
const FOLDS: f64 = 12.0;
const STEPS: usize = 120;

impl Fitter<'_> {
    /// The state with coefficients of one size held to the size that the rows show; itself where no cause has any.
    pub(crate) fn held_to_a_common_size(&self, state: FitState) -> FitState {
        let mut now = state;
        for _ in 0..*FITS {
            let Some(causes) = held(&now) else { return now };
            now = self.fit(&now.model, causes);
        }
        now
    }
}

/// The causes with the priors of their common size; none where no cause has one.
fn held(state: &FitState) -> Option<Vec<EstimatedCause>> {
    let covariance = state.fitted.covariance.as_ref()?;
    let mut causes = state.causes.clone();
    let mut any = false;
    for (cause, range) in causes.iter_mut().zip(&state.ranges) {
        let family = cause.form.of_one_size();
        if family.len() < 2 {
            continue;
        }
        let numbers: Vec<usize> = family.iter().map(|k| range.start + k).collect();
        let specs = cause.form.parameters(&state.model.robot);
        let estimated = numbers.iter().copied();
        let estimated = estimated.filter(|k| covariance.parameters().contains(k));
        let (free, plausible): (Vec<usize>, f64) =
            (estimated.collect(), specs[family[0]].tolerance);
        let Some(size) = size(&state.model, covariance, &free, plausible) else {
            continue;
        };
        // Bodies farther out are lighter and shorter: what rows hardly show of them is no larger than what they show of the arm's lines.
        let others = range
            .clone()
            .filter(|k| !numbers.contains(k) && is_shown(state, *k))
            .map(|k| state.model.x[k].abs());
        let most = others.fold(0.0, f64::max);
        let size = match most > 0.0 {
            true => size.clamp(*LEAST_SHARE * most, most),
            false => size,
        };
        any = true;
        let sigma = |k: usize| match specs[k].tolerance {
            _ if family.contains(&k) => size,
            plausible if most > 0.0 && !is_shown(state, range.start + k) => plausible.min(most),
            plausible => plausible,
        };
        let prior = |k: usize| Prior {
            mean: 0.0,
            sigma: sigma(k),
        };
        cause.priors = (0..specs.len()).map(prior).collect();
    }
    any.then_some(causes)
}

/// Whether the rows clearly show a coefficient.
fn is_shown(state: &FitState, k: usize) -> bool {
    let error = match state.fitted.statuses[k] {
        ParameterStatus::Free(sigma) => sigma,
        _ => f64::INFINITY,
    };
    state.model.x[k].powi(2) > *SHOWN * error * error
}

/// The largest size (SI) that the evidence allows, at most `plausible`; none where the parameters were not all estimated.
fn size(model: &Model, covariance: &Covariance, numbers: &[usize], plausible: f64) -> Option<f64> {
    let block = covariance.block(numbers)?;
    let values = DVector::from_iterator(numbers.len(), numbers.iter().map(|k| model.x[*k]));
    let prior = |k: &usize| {
        let prior = model.known(*k).prior;
        prior.map_or(0.0, |prior| prior.sigma.powi(-2))
    };
    let posterior = block.try_inverse()?;
    let about = &posterior * values;
    let priors = DVector::from_iterator(numbers.len(), numbers.iter().map(prior));
    let data = posterior - DMatrix::from_diagonal(&priors);
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = data.symmetric_eigen();
    let along = eigenvectors.transpose() * about;
    let evidence = |size: f64| -> f64 {
        let each = eigenvalues.iter().zip(along.iter());
        each.map(|(p, b)| (p.max(0.0), b))
            .map(|(p, b)| b * b / (p + size.powi(-2)) - (size * size * p).ln_1p())
            .sum()
    };
    let sizes = (0..=STEPS).map(|step| plausible * (-FOLDS * step as f64 / STEPS as f64).exp());
    let all: Vec<(f64, f64)> = sizes.map(|size| (size, evidence(size))).collect();
    let best = all.iter().map(|(_, evidence)| *evidence);
    let best = best.fold(f64::NEG_INFINITY, f64::max);
    // From the plausible size downwards: the loosest that rows do not speak against.
    let mut loosest = all
        .into_iter()
        .filter(|(_, evidence)| *evidence >= best - *AGAINST);
    let (loosest, _) = loosest.next()?;
    // What rows clearly show is as large as it is.
    let shown = eigenvalues
        .iter()
        .zip(along.iter())
        .filter(|(p, b)| **p > 0.0 && **b * **b > *SHOWN * **p)
        .map(|(p, b)| (b / p).abs());
    Some(shown.fold(loosest, f64::max).min(plausible))
}
