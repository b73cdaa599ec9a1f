//! `counterbalance` (and `cable_drag`): a spring missing from the torque model; its torque is of first order in the joint's angle.
//!
//! Balancers sit on joints 2 and 3; a torque by the angle of any other joint is that of a hose or cable. It is seen through the joint's compliance: without one it moves nothing.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Burden, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Counterbalance {
    joint: usize,
}

impl Counterbalance {
    /// Every joint that yields in the present model.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| survey.yielding[*joint] > 0.0);
        joints.map(|joint| Hypothesis::new(Self { joint }, 2).charged(2.0)).collect()
    }
}

impl Effect for Counterbalance {
    fn name(&self) -> &'static str {
        if (1..=2).contains(&self.joint) { "counterbalance" } else { "cable_drag" }
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        parameters(self, [("sin", Unit::NewtonMetre, 1e5), ("cos", Unit::NewtonMetre, 1e5)])
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        let (sine, cosine) = libm::sincos(state.q[self.joint]);
        out.load(0, self.joint, sine);
        out.load(1, self.joint, cosine);
    }

    fn needs_torque(&self) -> bool {
        true
    }

    fn burden(&self, q: &[f64], _payload: f64, p: &[f64], out: &mut Burden) {
        let (sine, cosine) = libm::sincos(q[self.joint]);
        out.torque[self.joint] += p[0] * sine + p[1] * cosine;
    }
}

impl Placed for Counterbalance {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }
}
