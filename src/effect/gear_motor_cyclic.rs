//! `gear_motor_cyclic`: error periodic in the motor angle (joint angle times reduction ratio), e.g. of the input stage.

use super::summary::amplitude;
use super::{Basis, Cause, CauseDescription, Hypothesis, Law, Motion, NumberSpec, Summary, Survey, Term, Variable};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct GearMotorCyclic;

/// Orders per motor turn that are tried: shaft, and two teeth or poles.
const ORDERS: u32 = 2;

impl Cause for GearMotorCyclic {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: "gear_motor_cyclic",
            place: "joint",
            formula: "d = a sin(n i q) + b cos(n i q), i the reduction ratio, n = 1, 2",
            size: "2 to 30 arcsec",
            confounded: "noise: nothing else is as fast",
            needs: "reduction ratios in the robot file",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let known = |joint: &usize| survey.robot.description().joints[*joint].reduction_ratio.is_some();
        let pairs = survey.revolute().filter(known).flat_map(|joint| (1..=ORDERS).map(move |order| (joint, order)));
        let law = |joint, order| Law::new(Variable::Motor { joint }, Basis::Wave { order, overtone: false });
        let terms = pairs.map(|(joint, order)| Term::new(&Self, Motion::Joint { joint }, law(joint, order)));
        terms.map(|term| Hypothesis::new(term, ORDERS as usize)).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        ["sin", "cos"].map(|name| (name.to_string(), Unit::Radian, 0.01)).to_vec()
    }

    fn variant(&self, term: &Term) -> String {
        if let Basis::Wave { order, .. } = term.basis() { format!("order{order}") } else { String::new() }
    }

    fn sentence(&self, summary: &Summary) -> String {
        let amplitude = amplitude(&summary.parameters.iter().collect::<Vec<_>>());
        format!("{} errs periodically with its motor's angle, amplitude {amplitude}", summary.place)
    }
}
