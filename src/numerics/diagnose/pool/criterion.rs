//! The criterion by which sets of hypotheses are compared: Bayesian information, the prior, and what physics forbids.

use super::hypotheses::HypothesisSet;
use super::solve::Solution;
use crate::criteria::search::IMPLAUSIBLE;
use crate::effect::{Hypothesis, follows};

/// Fall of the criterion by `rank` more parameters that lower the squared residual by `gain`.
pub(super) fn fall(n: f64, square: f64, gain: f64, rank: usize, prior_penalty: f64) -> f64 {
    n * (square / (square - gain).max(1e-300)).ln() - n.ln() * rank as f64 - prior_penalty
}

impl HypothesisSet<'_> {
    /// Whether all members of a set make sense together.
    pub(super) fn is_sound(&self, set: &[usize]) -> bool {
        let parted = |k: &usize| self.hypotheses[*k].inherits && !self.has_parent(*k, set);
        if set.iter().any(parted) {
            return false;
        }
        let yields = |k: &usize| self.hypotheses[*k].form.cause().yields_to_torque();
        !set.iter().any(|k| self.of_torque_model[*k]) || set.iter().any(yields)
    }

    /// Whether the law of which a hypothesis is a product is in a set.
    pub(super) fn has_parent(&self, h: usize, set: &[usize]) -> bool {
        set.iter().any(|k| follows(&self.hypotheses[h].form, &self.hypotheses[*k].form).is_some())
    }

    /// Bayesian information criterion of a set with the prior's penalties; implausible signs and sizes are penalised too.
    pub(super) fn criterion(&self, set: &[usize], solution: &Solution) -> f64 {
        let n = self.effective_rows;
        let rest = (self.square - solution.gain).max(1e-300);
        let penalties: f64 = set.iter().map(|k| self.prior_penalty[*k]).sum();
        n * (rest / n).ln() + n.ln() * solution.rank as f64 + penalties + self.sign_penalty(set, solution)
    }

    /// Penalty for every coefficient that has the wrong sign or is too large, and for what moves against its load, by more than two
    /// standard errors.
    fn sign_penalty(&self, set: &[usize], solution: &Solution) -> f64 {
        let mut from = 0;
        let against = set.iter().filter(|k| {
            let begin = from;
            from += self.first[**k + 1] - self.first[**k];
            self.hypotheses[**k]
                .form
                .is_against_load(&solution.coefficients[begin..from], &|column| 2.0 * solution.error(begin + column))
        });
        let against = against.count();
        let columns = set.iter().flat_map(|k| (self.first[*k]..self.first[*k + 1]).map(move |_| *k));
        let wrong = columns.zip(&solution.coefficients).enumerate().filter(|(column, (k, value))| {
            let Hypothesis { positive, largest, .. } = self.hypotheses[*k];
            let suspicious = positive && **value < 0.0 || value.abs() > largest;
            let error = if suspicious { solution.error(*column) } else { 0.0 };
            (positive && **value < -2.0 * error) || value.abs() - 2.0 * error > largest
        });
        *IMPLAUSIBLE * (wrong.count() + against) as f64
    }
}
