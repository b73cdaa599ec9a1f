//! `tracker_circle`: the horizontal circle of the instrument sits off its axis, or is out of round: azimuths err once or twice a turn.

use super::summary::amplitude;
use super::{
    Basis, Cause, CauseDescription, Hypothesis, Law, Measure, Motion, NumberSpec, Polar, Summary, Survey, Term, Variable,
};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct TrackerCircle;

/// Periods a turn.
const ORDERS: u32 = 2;

/// What shows errors of the instrument itself.
pub(super) const MEASURE: Measure = Measure { rank: 2, advice: "measure fixed points in both faces, and from a second station" };
/// An instrument in order errs less than an arm: -2 ln of the odds that it is the one.
pub(super) const RARER: f64 = 4.0;

impl Cause for TrackerCircle {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: "tracker_circle",
            place: "tracker",
            formula: "azimuth errs by a sin(n az) + b cos(n az), n = 1, 2",
            size: "0.5 to 5 arcsec",
            confounded: "base_frame and gear_cyclic of joint 1 where the azimuth changes little",
            needs: "points measured from outside the arm's reach, the instrument at the recording's origin",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let orders = (1..=ORDERS).filter(|_| survey.seen_from_outside());
        let law = |order| Law::new(Variable::Azimuth, Basis::Wave { order, overtone: false });
        let term = |order| Term::new(&Self, Motion::Instrument { of: Polar::Azimuth }, law(order));
        orders.map(|order| Hypothesis::new(term(order), ORDERS as usize).penalised(RARER)).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        ["sin", "cos"].map(|name| (name.to_string(), Unit::Radian, 1e-3)).into()
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
        format!("the tracker's azimuths err periodically: {}", orders.join(", "))
    }

    fn is_of_the_measurement(&self) -> bool {
        true
    }

    fn measure(&self) -> Option<Measure> {
        Some(MEASURE)
    }
}
