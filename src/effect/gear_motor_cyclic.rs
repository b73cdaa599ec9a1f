//! `gear_motor_cyclic`: error periodic in the motor angle (joint angle times reduction ratio), e.g. of the input stage.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GearMotorCyclic {
    joint: usize,
    /// Per turn of the motor.
    order: u32,
}

/// Orders per motor turn that are tried: shaft, and two teeth or poles.
const ORDERS: u32 = 2;

impl GearMotorCyclic {
    pub fn order(&self) -> u32 {
        self.order
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let known = |joint: &usize| survey.robot.description().joints[*joint].reduction_ratio.is_some();
        let forms = survey.revolute().filter(known).flat_map(|joint| (1..=ORDERS).map(move |order| Self { joint, order }));
        forms.map(|form| Hypothesis::new(form, ORDERS as usize)).collect()
    }
}

impl Effect for GearMotorCyclic {
    fn name(&self) -> &'static str {
        "gear_motor_cyclic"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        parameters(self, [("sin", Unit::Radian, 0.01), ("cos", Unit::Radian, 0.01)])
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let ratio = robot.description().joints[self.joint].reduction_ratio.unwrap_or(0.0);
        let (sine, cosine) = libm::sincos(f64::from(self.order) * ratio * state.q[self.joint]);
        out.turn(0, p, self.joint, sine);
        out.turn(1, p, self.joint, cosine);
    }
}

impl Placed for GearMotorCyclic {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn variant(&self) -> String {
        format!("order{}", self.order)
    }
}
