//! Errors of whole periods a turn, and of periods between.

use super::{Basis, Motion, Survey, Term};
use std::f64::consts::TAU;

/// An order needs this much of its phase (rad) within the joint's travel to be more than a line.
const PHASE: f64 = 2.2;

/// A sine and a cosine of any order: of whole periods a turn, or not.
pub(super) fn of_order(order: f64) -> Basis {
    let whole = order.round();
    if (order - whole).abs() < 1e-9 && whole >= 1.0 {
        Basis::Wave {
            order: whole as u32,
            overtone: false,
        }
    } else {
        Basis::Sway {
            period: TAU / order,
        }
    }
}

/// Periods a turn of a sine and a cosine; none of another basis.
pub(super) fn order(basis: Basis) -> Option<f64> {
    match basis {
        Basis::Wave { order, .. } => Some(f64::from(order)),
        Basis::Sway { period } => Some(TAU / period),
        _ => None,
    }
}

/// Whether a joint of this travel (rad) shows more of an order than a line.
pub(super) fn is_within(order: f64, travel: f64) -> bool {
    order * travel > PHASE
}

/// An order in the name of a parameter, which has no points.
pub(super) fn in_name(order: f64) -> String {
    format!("{:.3}", order)
        .trim_end_matches('0')
        .trim_end_matches('.')
        .replace('.', "_")
}

/// Orders between those of a wave of a joint's angle: a gear stage need not be in phase with its joint.
pub(super) fn near(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    let (Motion::Joint { joint }, None, Some(order)) =
        (term.motion(), term.law().times, order(term.basis()))
    else {
        return Vec::new();
    };
    let step = 0.25 * libm::exp2(-f64::from(level));
    let orders = [order - step, order + step]
        .into_iter()
        .filter(|order| is_within(*order, survey.travel(joint)));
    term.with_bases(orders.map(of_order))
}
