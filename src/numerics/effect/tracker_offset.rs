//! `tracker_offset`: every range is wrong by the same length: a dead path, or the constant of another reflector.

use super::{Basis, Cause, Hypothesis, Law, Measure, Motion, NumberSpec, Polar, Summary, Survey, Term, Variable, about, figure};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct TrackerOffset;

/// 1 at any range.
const ANY: Basis = Basis::After { at: 0.0 };

impl Cause for TrackerOffset {
    about! {
        name: "tracker_offset",
        place: "tracker",
        formula: "ranges are longer by c",
        size: "5 um to the radius of a reflector",
        confounded: "base_frame and link_geometry, which absorb most of it from afar",
        needs: "points measured from outside the arm's reach, the instrument at the recording's origin",
        measure: Some(Measure { rank: 2, advice: "measure a line of three points from within it and from its end" }),
        of_the_measurement: true,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let term = Term::new(&Self, Motion::Instrument { of: Polar::Range }, Law::new(Variable::Range, ANY));
        survey.seen_from_outside().then(|| Hypothesis::new(term, 1).penalised(*RARE)).into_iter().collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        vec![("offset".into(), Unit::Millimetre, 0.01)]
    }

    fn sentence(&self, summary: &Summary) -> String {
        let um = summary.parameters.first().map_or_else(String::new, |n| figure(n.value * 1e3, 0));
        format!("every range of the tracker is wrong by {um} um")
    }
}
