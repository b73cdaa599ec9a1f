//! `gear_load`: a periodic gear error whose size follows the load: an eccentric wheel or a bearing that yields, felt under torque.

use super::{Cause, Hypothesis, Measure, NumberSpec, Summary, Survey, Term, Variable, about, orders};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct GearLoad;

/// Orders per joint turn that are tried.
const ORDERS: u32 = 24;

impl Cause for GearLoad {
    about! {
        name: "gear_load",
        place: "joint",
        formula: "d = t (a sin(n q) + b cos(n q)), n = 1 .. 24",
        size: "2 to 40 arcsec under full load",
        confounded: "gear_cyclic where the load hardly changes, joint_compliance where the joint travels little",
        needs: "link masses, loads that change at the same angle",
        measure: Some(Measure {
            rank: 5,
            advice: "repeat poses with and without a payload over the whole range of the joint",
        }),
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| survey.is_loaded(*joint));
        let all = orders::followed(&Self, survey, joints, ORDERS, |joint| Variable::Load { joint });
        all.into_iter().map(|hypothesis| hypothesis.penalised(*RARE)).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        orders::numbers(Unit::RadianPerNewtonMetre, 1e-4)
    }

    fn sentence(&self, summary: &Summary) -> String {
        let orders = orders::in_words(summary, self.name());
        format!("the gear of {} errs periodically, in proportion to its load: {}", summary.place, orders)
    }
}
