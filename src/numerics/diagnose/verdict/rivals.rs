//! What explains as well as a finding: other causes that fit equally well here, and those that no data could tell from it.

use super::last_round::LastRound;
use crate::criteria::search::EQUIVALENT;
use crate::criteria::words::FIRM;
use crate::diagnose::types::RivalCause;
use crate::effect::{Form, Place, Survey, moved_with_the_payload};

/// Other single causes that do as well in place of `own`, with numbers that they can have.
pub(super) fn rivals(last: &LastRound, rest: &[usize], own: &[usize], bic: f64, named: (&str, Place)) -> Vec<RivalCause> {
    let pool = last.pool;
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
        if delta - pool.prior_penalty[h] + own_penalty < *EQUIVALENT && is_possible(last, &set, h) {
            out.push(RivalCause { effect, place, delta_bic: delta, probability: 0.0 });
        }
    }
    out
}

/// Whether a hypothesis of a set has numbers there that its cause can have.
fn is_possible(last: &LastRound, set: &[usize], h: usize) -> bool {
    let pool = last.pool;
    let Some(own) = set.iter().zip(pool.coefficients(set)).find(|(k, _)| **k == h).map(|(_, own)| own) else { return true };
    let form = &pool.hypotheses[h].form;
    let solution = pool.solve(set);
    let first: usize = set.iter().take_while(|k| **k != h).map(|k| pool.first[k + 1] - pool.first[*k]).sum();
    let error = |column: usize| *FIRM * solution.error(first + column);
    form.impossible(&own, &error, last.survey).is_none()
}

/// Identities of kinematics and statics, whatever the data; and what may have moved when a payload changed that changes only once.
pub(super) fn exact(effect: &str, forms: &[Form], survey: &Survey, rivals: &mut Vec<RivalCause>) {
    let moved = forms.iter().filter_map(|form| moved_with_the_payload(form, survey));
    for (other, place) in forms.iter().flat_map(|form| form.identities(effect)).chain(moved) {
        if !rivals.iter().any(|rival| rival.effect == other && rival.place == place) {
            rivals.push(RivalCause { effect: other, place, delta_bic: 0.0, probability: 0.0 });
        }
    }
}
