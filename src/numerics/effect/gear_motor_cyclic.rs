//! `gear_motor_cyclic`: error periodic in the motor angle (joint angle times reduction ratio), e.g. of the input stage.

use super::summary::amplitude;
use super::{Cause, Hypothesis, Motion, NumberSpec, Summary, Survey, Term, Variable, about, orders};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct GearMotorCyclic;

/// Orders per motor turn that are tried: shaft, and two teeth or poles.
const ORDERS: u32 = 2;

impl Cause for GearMotorCyclic {
    about! {
        name: "gear_motor_cyclic",
        place: "joint",
        formula: "d = a sin(n i q) + b cos(n i q), i the reduction ratio, n = 1, 2",
        size: "2 to 30 arcsec",
        confounded: "noise: nothing else is as fast",
        needs: "reduction ratios in the robot file",
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let known = |joint: &usize| survey.robot.description().joints[*joint].reduction_ratio.is_some();
        let pairs = survey.revolute().filter(known).flat_map(|joint| (1..=ORDERS).map(move |order| (joint, order)));
        let law = |joint, order| orders::wave(Variable::Motor { joint }, order);
        let terms = pairs.map(|(joint, order)| Term::new(&Self, Motion::Joint { joint }, law(joint, order)));
        terms.map(|term| Hypothesis::new(term, ORDERS as usize)).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        orders::numbers(Unit::Radian, 0.01)
    }

    fn sentence(&self, summary: &Summary) -> String {
        let amplitude = amplitude(&summary.parameters.iter().collect::<Vec<_>>());
        format!("{} errs periodically with its motor's angle, amplitude {amplitude}", summary.place)
    }
}
