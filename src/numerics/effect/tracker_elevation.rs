//! `tracker_elevation`: the head of the instrument errs with the elevation: it sags, its vertical circle sits off its axis, its transit axis
//! is not level, or the beam leaves it askew.

use super::summary::amplitude;
use super::tracker_circle::MEASURE;
use super::{Cause, Hypothesis, Motion, NumberSpec, Polar, Summary, Survey, Term, Variable, about, names, orders};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct TrackerElevation;

/// What errs, and how often a turn: the elevation once and twice, the azimuth once, which a transit axis that is not level turns by the
/// tangent of the elevation.
const WAYS: [(Polar, u32); 3] = [(Polar::Elevation, 1), (Polar::Elevation, 2), (Polar::Azimuth, 1)];

impl Cause for TrackerElevation {
    about! {
        name: names::TRACKER_ELEVATION,
        place: "tracker",
        formula: "elevation or azimuth errs by a sin(n el) + b cos(n el), n = 1, 2",
        size: "0.5 to 5 arcsec",
        confounded: "base_frame and link_geometry where the elevation changes little",
        needs: "points measured from outside the arm's reach, the instrument at the recording's origin, its z upright",
        measure: Some(MEASURE),
        of_the_measurement: true,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let ways = WAYS.into_iter().filter(|_| survey.seen_from_outside());
        let wave = |order| orders::wave(Variable::Elevation, order);
        let terms = ways.map(|(of, order)| Term::new(&Self, Motion::Instrument { of }, wave(order)));
        terms.map(|term| Hypothesis::new(term, WAYS.len()).penalised(*RARE)).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        orders::numbers(Unit::Radian, 1e-3)
    }

    fn variant(&self, term: &Term) -> String {
        match term.motion() {
            Motion::Instrument { of: Polar::Azimuth } => "transit".into(),
            _ => orders::variant(term),
        }
    }

    fn sentence(&self, summary: &Summary) -> String {
        let ways = summary.estimates(self.name()).map(|(term, numbers)| {
            let azimuth = term.motion() == Motion::Instrument { of: Polar::Azimuth };
            format!("{} by {}", if azimuth { "azimuths" } else { "elevations" }, amplitude(&numbers))
        });
        let ways: Vec<String> = ways.collect();
        format!("the tracker's head errs with the elevation: {}", ways.join(", "))
    }
}
