//! What explains as well as a finding: other causes that fit equally well here, and those that no data could tell from it.

use crate::diagnose::pool::{CachedHypotheses, EQUIVALENT};
use crate::diagnose::types::RivalCause;
use crate::effect::{Effect, Form, Place};

/// Other single causes that do as well in place of `own`.
pub(super) fn rivals(pool: &CachedHypotheses, rest: &[usize], own: &[usize], bic: f64, named: (&str, Place)) -> Vec<RivalCause> {
    let given = pool.given(rest);
    let own_penalty: f64 = own.iter().map(|k| pool.prior_penalty[*k]).sum();
    let mut out: Vec<RivalCause> = Vec::new();
    for (_, h) in given.falls.iter().copied().take(60) {
        let form = &pool.hypotheses[h].form;
        let (effect, place) = (form.name(), form.place());
        if (effect, place) == named || out.iter().any(|rival| rival.effect == effect && rival.place == place) {
            continue;
        }
        let mut set = rest.to_vec();
        set.push(h);
        set.sort_unstable();
        let delta = pool.bic(&set) - bic;
        // What counts is the fit: the prior's penalties are opinions.
        if delta - pool.prior_penalty[h] + own_penalty < EQUIVALENT {
            out.push(RivalCause { effect, place, delta_bic: delta, probability: 0.0 });
        }
    }
    out
}

/// Identities of kinematics and statics, whatever the data.
pub(super) fn exact(effect: &str, forms: &[Form], rivals: &mut Vec<RivalCause>) {
    for (other, place) in forms.iter().flat_map(|form| form.cause().identities(form, effect)) {
        if !rivals.iter().any(|rival| rival.effect == other && rival.place == place) {
            rivals.push(RivalCause { effect: other, place, delta_bic: 0.0, probability: 0.0 });
        }
    }
}
