//! `payload_error`: the payload's mass (and first moment) differs from what was declared, where one is carried.

use super::form::parameters;
use super::spring::MEASURE;
use super::{
    ArmState, Cause, CauseDescription, Deflection, Effect, Form, Hypothesis, Measure, ParameterSpec, Place, Placed, Summary,
    Survey, Variable, figure,
};
use crate::robot::{LoadCorrection, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub struct PayloadError;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WrongPayload {
    /// Whether the centre is wrong too.
    centre: bool,
}

impl Cause for PayloadError {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: "payload_error",
            place: "tool",
            formula: "mass and centre of the payload in the torque model",
            size: "3 to 30 %",
            confounded: "joint_hardening",
            needs: "rows with and without the payload",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let yields = survey.compliance.iter().any(|compliance| *compliance > 0.0);
        let forms = [false, true].into_iter().filter(|_| yields && survey.heavy_payload() > 0.0);
        forms.map(|centre| Hypothesis::new(WrongPayload { centre }, 2)).collect()
    }

    fn sentence(&self, summary: &Summary) -> String {
        match summary.parameters.first() {
            Some(n) => {
                let how = if n.value < 0.0 { "lighter" } else { "heavier" };
                format!("the payload is {} % {how} than declared", figure(n.value.abs() * 100.0, 1))
            }
            None => "the payload is not what was declared".to_string(),
        }
    }

    fn measure(&self) -> Option<Measure> {
        Some(MEASURE)
    }

    fn read(&self, body: &serde_json::Value) -> Option<serde_json::Result<Form>> {
        Some(WrongPayload::deserialize(body).map(Form::from))
    }
}

impl Effect for WrongPayload {
    fn name(&self) -> &'static str {
        PayloadError.about().name
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

    fn load_correction(&self, _q: &[f64], payload: f64, p: &[f64], out: &mut LoadCorrection) {
        out.payload += p[0] * payload;
        if self.centre {
            out.payload_moment += Vector3::new(p[1], p[2], p[3]) * payload;
        }
    }
}

impl Placed for WrongPayload {
    fn place(&self) -> Place {
        Place::Tool
    }

    fn cause(&self) -> &'static dyn Cause {
        &PayloadError
    }

    fn variables(&self) -> Vec<Variable> {
        vec![Variable::Payload]
    }

    fn is_of_torque_model(&self) -> bool {
        true
    }

    fn body(&self) -> serde_json::Value {
        serde_json::json!(self)
    }
}
