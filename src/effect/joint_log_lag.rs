//! `joint_log_lag`: the joints were logged before the arm had settled: the tool stands a share of the last move further on.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointLogLag {
    /// Whether each joint lags by a share of its own; else all by one.
    each: bool,
}

impl JointLogLag {
    pub fn propose(_survey: &Survey) -> Vec<Hypothesis> {
        [false, true].map(|each| Hypothesis::new(Self { each }, 2)).to_vec()
    }
}

impl Effect for JointLogLag {
    fn name(&self) -> &'static str {
        "joint_log_lag"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let names: Vec<String> = (1..=robot.joints()).map(|joint| format!("share_j{joint}")).collect();
        if self.each {
            parameters(self, names.iter().map(|name| (name.as_str(), Unit::One, 0.1)))
        } else {
            parameters(self, [("share", Unit::One, 0.1)])
        }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for joint in 0..robot.joints() {
            out.turn(if self.each { joint } else { 0 }, p, joint, state.last_move(joint));
        }
    }
}

impl Placed for JointLogLag {
    fn place(&self) -> Place {
        Place::Recording
    }
}
