//! What explains as well as a finding: other causes that fit alike here, and those that no data could tell from it.

use super::ALIKE;
use super::finding::Rival;
use super::pool::Pool;
use crate::effect::{Effect, Form, Place, Placed, Signature};

/// Other single causes that do as well in place of `own`.
pub(super) fn rivals(pool: &Pool, rest: &[usize], own: &[usize], bic: f64, named: (&str, &str)) -> Vec<Rival> {
    let state = pool.state(rest);
    let own_charge: f64 = own.iter().map(|k| pool.charge[*k]).sum();
    let mut out: Vec<Rival> = Vec::new();
    for (_, h) in state.falls(pool).iter().copied().take(60) {
        let form = &pool.hypotheses[h].form;
        let (effect, place) = (form.name(), form.place().to_string());
        if (effect, place.as_str()) == named || out.iter().any(|rival| rival.effect == effect && rival.place == place) {
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
pub(super) fn exact(effect: &str, forms: &[Form], place: &str, rivals: &mut Vec<Rival>) {
    let mut add = |effect: &'static str, place: &str| {
        if !rivals.iter().any(|rival| rival.effect == effect && rival.place == place) {
            rivals.push(Rival { effect, place: place.to_string(), delta_bic: 0.0 });
        }
    };
    for form in forms {
        match form {
            Form::ZeroShift(_) if place == "joint 1" => add("base_shift", "base"),
            Form::GearCyclic(gear) if gear.order() == 1 => add("counterbalance", place),
            Form::Unknown(unknown) => match unknown.signature() {
                Signature::Periodic { by, .. } => add("axis_wobble", &Place::Joint(by).to_string()),
                // No motor current tells of a pull.
                _ if effect == "cable_drag" => add("unknown", place),
                Signature::Product { .. } | Signature::Surface { .. } if place.starts_with("joint") => add("cable_drag", place),
                _ => (),
            },
            Form::JointHardening(_) if effect == "backlash" => add("joint_hardening", place),
            // The torque of a link about its own joint is of first order in that joint's angle, as a balancer's; a hose pulls by it too.
            Form::Counterbalance(_) => {
                if effect == "counterbalance" {
                    add("cable_drag", place);
                }
                add("gear_cyclic", place);
                add("link_mass", &place.replace("joint", "link"));
            }
            Form::LinkMass(_) if matches!(form.place(), Place::Links(1 | 2, _)) => {
                add("counterbalance", &place.replace("link", "joint"));
            }
            _ => (),
        }
    }
}
