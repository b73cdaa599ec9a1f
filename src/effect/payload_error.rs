//! `payload_error`: the payload's mass (and first moment) differs from what was declared, where one is carried.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Burden, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PayloadError {
    /// Whether the centre is wrong too.
    centre: bool,
}

impl PayloadError {
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let yields = survey.yielding.iter().any(|compliance| *compliance > 0.0);
        let forms = [false, true].into_iter().filter(|_| yields && survey.heavy_payload() > 0.0);
        forms.map(|centre| Hypothesis::new(Self { centre }, 2)).collect()
    }
}

impl Effect for PayloadError {
    fn name(&self) -> &'static str {
        "payload_error"
    }

    /// In shares of the declared payload, so that an empty flange stays empty.
    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let mass = ("mass", Unit::One, 1.0);
        let centre = ["x", "y", "z"].map(|axis| (axis, Unit::Millimetre, 1.0));
        if self.centre { parameters(self, std::iter::once(mass).chain(centre)) } else { parameters(self, [mass]) }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        let last = robot.joints() - 1;
        for joint in 0..=last {
            out.load(0, joint, state.posture.torque_of_payload(robot, joint) * state.payload());
            if self.centre {
                let torque = state.posture.torque_of_moment(robot, joint, last) * state.payload();
                for axis in 0..3 {
                    out.load(axis + 1, joint, torque[axis]);
                }
            }
        }
    }

    fn needs_torque(&self) -> bool {
        true
    }

    fn burden(&self, _q: &[f64], payload: f64, p: &[f64], out: &mut Burden) {
        out.payload += p[0] * payload;
        if self.centre {
            out.payload_moment += Vector3::new(p[1], p[2], p[3]) * payload;
        }
    }
}

impl Placed for PayloadError {
    fn place(&self) -> Place {
        Place::Tool
    }
}
