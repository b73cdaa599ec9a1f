//! `payload_error`: the payload's mass (and first moment) differs from what was declared, where one is carried.

use super::form::placed;
use super::spring::MEASURE;
use super::{
    ArmState, Cause, Deflection, Form, Hypothesis, NumberSpec, OwnMotion, Place, Placed, Summary,
    Survey, Variable, figure, names,
};
use crate::criteria::effect::RARE;
use crate::robot::{LoadCorrection, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct WrongPayload {
    /// Whether the centre is wrong too.
    centre: bool,
    /// Whether it is a mass at the tool that every row carries, beside the declared payload.
    #[serde(default)]
    tool: bool,
}

/// A tool of which nothing is known weighs this much, kg (one sigma), or as much as the heaviest declared payload.
const TOOL: f64 = 5.0;

pub(super) static CAUSE: Cause = Cause {
    name: names::PAYLOAD_ERROR,
    place: "tool",
    formula: "mass and centre of the payload, or an unstated mass at the tool, in the torque model",
    size: "3 to 30 %",
    confounded: "joint_hardening",
    needs: "rows with and without the payload",
    measure: Some(MEASURE),
    motion: Some(OwnMotion {
        propose,
        sentence: Some(sentence),
        read: Form::kept::<WrongPayload>,
    }),
    ..Cause::PLAIN
};

fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let yields = survey.compliance.iter().any(|compliance| *compliance > 0.0);
    let forms = [false, true]
        .into_iter()
        .filter(|_| yields && survey.heavy_payload() > 0.0);
    let mut out: Vec<Hypothesis> = forms
        .map(|centre| {
            Hypothesis::new(
                WrongPayload {
                    centre,
                    tool: false,
                },
                2,
            )
        })
        .collect();
    // Without any mass of the links nothing says how much of a wind-up is the tool's.
    let weighs = survey
        .robot
        .description()
        .joints
        .iter()
        .any(|joint| joint.mass.is_some());
    if yields && weighs {
        out.push(
            Hypothesis::new(
                WrongPayload {
                    centre: false,
                    tool: true,
                },
                2,
            )
            .penalised(*RARE),
        );
    }
    out
}

fn sentence(summary: &Summary) -> String {
    match summary.parameters.first() {
        // A tool's mass is its only form that loads an arm without a payload.
        Some(n)
            if summary
                .variables(names::PAYLOAD_ERROR)
                .contains(&Variable::ArmLoad) =>
        {
            let how = if n.value < 0.0 { "less" } else { "more" };
            format!(
                "the tool weighs {} kg {how} than the robot file and the payload say",
                figure(n.value.abs(), 1)
            )
        }
        Some(n) => {
            let how = if n.value < 0.0 { "lighter" } else { "heavier" };
            format!(
                "the payload is {} % {how} than declared",
                figure(n.value.abs() * 100.0, 1)
            )
        }
        None => "the payload is not what was declared".to_string(),
    }
}

impl Placed for WrongPayload {
    placed! { self: Place::Tool, &CAUSE, [if self.tool { Variable::ArmLoad } else { Variable::Payload }], self }

    /// In shares of the declared payload, so that an empty flange stays empty.
    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec> {
        if self.tool {
            return vec![(
                "tool_mass".into(),
                Unit::Kilogram,
                TOOL.max(robot.description().payload_mass),
            )];
        }
        let mass = ("mass".into(), Unit::One, 1.0);
        let centre = ["x", "y", "z"].map(|axis| (axis.into(), Unit::Millimetre, 1.0));
        std::iter::once(mass)
            .chain(centre.into_iter().filter(|_| self.centre))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        let last = robot.joints() - 1;
        for joint in 0..=last {
            let carried = if self.tool { 1.0 } else { state.payload() };
            out.load(
                0,
                joint,
                state.posture.torque_of_payload(robot, joint) * carried,
            );
            if self.centre {
                let torque = state.posture.torque_of_moment(robot, joint, last) * state.payload();
                for axis in 0..3 {
                    out.load(axis + 1, joint, torque[axis]);
                }
            }
        }
    }

    fn load_correction(&self, _q: &[f64], payload: f64, p: &[f64], out: &mut LoadCorrection) {
        out.payload += p[0] * if self.tool { 1.0 } else { payload };
        if self.centre {
            out.payload_moment += Vector3::new(p[1], p[2], p[3]) * payload;
        }
    }

    fn is_of_torque_model(&self) -> bool {
        true
    }
}
