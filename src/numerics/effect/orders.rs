//! Errors of whole periods a turn: what the causes that err by a sine and a cosine of an angle have in common.

use super::summary::amplitude;
use super::{Basis, Cause, Hypothesis, Law, Motion, NumberSpec, Summary, Survey, Term, Variable};
use crate::units::Unit;
use std::f64::consts::TAU;

/// An order needs this much of its phase (rad) within the joint's travel to be more than a line.
const PHASE: f64 = 2.2;

/// What no gear or encoder errs by, rad.
pub(super) const BEYOND: f64 = 5e-3;

/// A sine and a cosine of `order` times the variable.
pub(super) fn wave(of: Variable, order: u32) -> Law {
    Law::new(of, Basis::Wave { order, overtone: false })
}

/// A sine and a cosine of any order: of whole periods a turn, or not.
pub(super) fn of_order(order: f64) -> Basis {
    let whole = order.round();
    if (order - whole).abs() < 1e-9 && whole >= 1.0 {
        Basis::Wave { order: whole as u32, overtone: false }
    } else {
        Basis::Sway { period: TAU / order }
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

/// The orders up to `most` of which the joint travels more than a line's worth.
pub(super) fn within_travel(survey: &Survey, joint: usize, most: u32) -> impl Iterator<Item = u32> + use<> {
    let travel = survey.travel(joint);
    (1..=most).filter(move |order| f64::from(*order) * travel > PHASE)
}

/// Waves of the angles of joints up to order `most`, each of a size that follows a variable of its joint.
pub(super) fn followed(
    cause: &'static dyn Cause,
    survey: &Survey,
    joints: impl Iterator<Item = usize>,
    most: u32,
    by: fn(usize) -> Variable,
) -> Vec<Hypothesis> {
    let terms = joints.flat_map(|joint| {
        let law = move |order| wave(Variable::Angle { joint }, order).times(by(joint), Basis::PROPORTIONAL);
        within_travel(survey, joint, most).map(move |order| Term::new(cause, Motion::Joint { joint }, law(order)))
    });
    terms.map(|term| Hypothesis::new(term, 2 * most as usize)).collect()
}

/// The numbers of such an error, with the scale of each.
pub(super) fn numbers(unit: Unit, scale: f64) -> Vec<NumberSpec> {
    ["sin", "cos"].map(|name| (name.to_string(), unit, scale)).into()
}

/// `order` and its number.
pub(super) fn variant(term: &Term) -> String {
    order(term.basis()).map_or_else(String::new, |order| format!("order{}", in_name(order)))
}

/// An order in the name of a parameter, which has no points.
fn in_name(order: f64) -> String {
    format!("{:.3}", order).trim_end_matches('0').trim_end_matches('.').replace('.', "_")
}

/// Every order of a cause with its amplitude, e.g. "2 times a turn by 11 arcsec".
pub(super) fn in_words(summary: &Summary, cause: &'static str) -> String {
    let orders = summary.estimates(cause).filter_map(|(term, numbers)| match term.basis() {
        Basis::Wave { order, .. } => Some(format!("{order} times a turn by {}", amplitude(&numbers))),
        _ => None,
    });
    orders.collect::<Vec<String>>().join(", ")
}
