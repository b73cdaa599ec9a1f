//! `gear_flank`: the two flanks of a wheel's teeth have run-outs of their own; half their difference changes sign with the approach.

use super::{Cause, Hypothesis, Measure, NumberSpec, Summary, Survey, Term, Variable, about, orders};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct GearFlank;

/// Orders per joint turn that are tried: grinding errors are of few periods a turn.
const ORDERS: u32 = 24;

impl Cause for GearFlank {
    about! {
        name: "gear_flank",
        place: "joint",
        formula: "d = s (a sin(n q) + b cos(n q)), n = 1 .. 24",
        size: "2 to 40 arcsec",
        confounded: "backlash where the joint travels little, gear_cyclic where all poses are approached from one side",
        needs: "both directions of approach over the joint's range",
        measure: Some(Measure { rank: 5, advice: "repeat poses from both sides over the whole range of the joint" }),
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| survey.both_directions(*joint));
        orders::followed(&Self, survey, joints, ORDERS, |joint| Variable::Approach { joint })
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        orders::numbers(Unit::Radian, 0.01)
    }

    fn sentence(&self, summary: &Summary) -> String {
        let orders = orders::in_words(summary, self.name());
        format!("the two flanks of the teeth of {} err differently: {} to either side", summary.place, orders)
    }
}
