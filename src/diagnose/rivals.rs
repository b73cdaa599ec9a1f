//! What explains as well as a finding: other causes that fit alike here, and those that no data could tell from it.

use super::ALIKE;
use super::finding::Rival;
use super::pool::Pool;
use crate::effect::{Effect, Form, Place};

/// Other single causes that do as well in place of `own`.
pub(super) fn rivals(pool: &Pool, rest: &[usize], own: &[usize], bic: f64, named: (&str, Place)) -> Vec<Rival> {
    let state = pool.state(rest);
    let own_charge: f64 = own.iter().map(|k| pool.charge[*k]).sum();
    let mut out: Vec<Rival> = Vec::new();
    for (_, h) in state.falls(pool).iter().copied().take(60) {
        let form = &pool.hypotheses[h].form;
        let (effect, place) = (form.name(), form.place());
        if (effect, place) == named || out.iter().any(|rival| rival.effect == effect && rival.place == place) {
            continue;
        }
        let mut set = rest.to_vec();
        set.push(h);
        set.sort_unstable();
        let delta = pool.bic(&set) - bic;
        // What counts is the fit: the prior's charges are opinions.
        if delta - pool.charge[h] + own_charge < ALIKE {
            out.push(Rival { effect, place, delta_bic: delta });
        }
    }
    out
}

/// Identities of kinematics and statics, whatever the data.
pub(super) fn exact(effect: &str, forms: &[Form], rivals: &mut Vec<Rival>) {
    for (other, place) in forms.iter().flat_map(|form| form.cause().identities(form, effect)) {
        if !rivals.iter().any(|rival| rival.effect == other && rival.place == place) {
            rivals.push(Rival { effect: other, place, delta_bic: 0.0 });
        }
    }
}
