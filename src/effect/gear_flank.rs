//! `gear_flank`: the two flanks of a wheel's teeth have run-outs of their own; half their difference changes sign with the approach.

use super::summary::amplitude;
use super::{Basis, Cause, CauseDescription, Hypothesis, Law, Measure, Motion, NumberSpec, Summary, Survey, Term, Variable};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct GearFlank;

/// Orders per joint turn that are tried: grinding errors are of few periods a turn.
const ORDERS: u32 = 24;
/// An order needs this much of its phase (rad) within the joint's travel to be more than lost motion and its slope.
const PHASE: f64 = 2.2;

impl GearFlank {
    fn term(joint: usize, order: u32) -> Term {
        let wave = Law::new(Variable::Angle { joint }, Basis::Wave { order, overtone: false });
        Term::new(&Self, Motion::Joint { joint }, wave.times(Variable::Approach { joint }, Basis::PROPORTIONAL))
    }
}

impl Cause for GearFlank {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: "gear_flank",
            place: "joint",
            formula: "d = s (a sin(n q) + b cos(n q)), n = 1 .. 24",
            size: "2 to 40 arcsec",
            confounded: "backlash where the joint travels little, gear_cyclic where all poses are approached from one side",
            needs: "both directions of approach over the joint's range",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| survey.both_directions(*joint));
        let terms = joints.flat_map(|joint| {
            let orders = (1..=ORDERS).filter(move |order| f64::from(*order) * survey.travel(joint) > PHASE);
            orders.map(move |order| Hypothesis::new(Self::term(joint, order), 2 * ORDERS as usize))
        });
        terms.collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        ["sin", "cos"].map(|name| (name.to_string(), Unit::Radian, 0.01)).into()
    }

    fn variant(&self, term: &Term) -> String {
        if let Basis::Wave { order, .. } = term.basis() { format!("order{order}") } else { String::new() }
    }

    fn sentence(&self, summary: &Summary) -> String {
        let orders = summary.estimates(self.name()).filter_map(|(term, numbers)| match term.basis() {
            Basis::Wave { order, .. } => Some(format!("{order} times a turn by {}", amplitude(&numbers))),
            _ => None,
        });
        let orders: Vec<String> = orders.collect();
        format!("the two flanks of the teeth of {} err differently: {} to either side", summary.place, orders.join(", "))
    }

    fn finer(&self) -> &'static [&'static str] {
        &["backlash", "unknown"]
    }

    fn measure(&self) -> Option<Measure> {
        Some(Measure { rank: 5, advice: "repeat poses from both sides over the whole range of the joint" })
    }
}
