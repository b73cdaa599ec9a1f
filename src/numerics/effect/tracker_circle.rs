//! `tracker_circle`: the horizontal circle of the instrument sits off its axis, or is out of round: azimuths err once or twice a turn.

use super::{Cause, Hypothesis, Measure, Motion, NumberSpec, Polar, Summary, Survey, Term, Variable, about, names, orders};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct TrackerCircle;

/// Periods a turn.
const ORDERS: u32 = 2;

/// What shows errors of the instrument itself.
pub(super) const MEASURE: Measure = Measure { rank: 2, advice: "measure fixed points in both faces, and from a second station" };

impl Cause for TrackerCircle {
    about! {
        name: names::TRACKER_CIRCLE,
        place: "tracker",
        formula: "azimuth errs by a sin(n az) + b cos(n az), n = 1, 2",
        size: "0.5 to 5 arcsec",
        confounded: "base_frame and gear_cyclic of joint 1 where the azimuth changes little",
        needs: "points measured from outside the arm's reach, the instrument at the recording's origin",
        measure: Some(MEASURE),
        of_the_measurement: true,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let orders = (1..=ORDERS).filter(|_| survey.seen_from_outside());
        let motion = Motion::Instrument { of: Polar::Azimuth };
        let term = |order| Term::new(&Self, motion, orders::wave(Variable::Azimuth, order));
        orders.map(|order| Hypothesis::new(term(order), ORDERS as usize).penalised(*RARE)).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        orders::numbers(Unit::Radian, 1e-3)
    }

    fn sentence(&self, summary: &Summary) -> String {
        let orders = orders::in_words(summary, self.name());
        format!("the tracker's azimuths err periodically: {orders}")
    }
}
