//! Errors of whole periods a turn: what the causes that err by a sine and a cosine of an angle have in common.

use super::summary::amplitude;
use super::{Basis, Cause, Hypothesis, Law, Motion, NumberSpec, Summary, Survey, Term, Variable};
use crate::units::Unit;

/// An order needs this much of its phase (rad) within the joint's travel to be more than a line.
const PHASE: f64 = 2.2;

/// Twice what the worst gears and encoders err by, rad (206 arcsec), and what none does.
pub(super) const LARGE: f64 = 1e-3;
pub(super) const BEYOND: f64 = 5e-3;

/// A sine and a cosine of `order` times the variable.
pub(super) fn wave(of: Variable, order: u32) -> Law {
    Law::new(of, Basis::Wave { order, overtone: false })
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
    if let Basis::Wave { order, .. } = term.basis() { format!("order{order}") } else { String::new() }
}

/// Every order of a cause with its amplitude, e.g. "2 times a turn by 11 arcsec".
pub(super) fn in_words(summary: &Summary, cause: &'static str) -> String {
    let orders = summary.estimates(cause).filter_map(|(term, numbers)| match term.basis() {
        Basis::Wave { order, .. } => Some(format!("{order} times a turn by {}", amplitude(&numbers))),
        _ => None,
    });
    orders.collect::<Vec<String>>().join(", ")
}
