//! `joint_log_lag`: joints and points are not of one moment. Of standing points a share of the last move was still to come when the
//! joints were logged; of a moving arm the two clocks are apart: each joint is dq/dt times the same time further on.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

/// What the lag goes with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Behind {
    /// The last move of each joint.
    #[default]
    Move,
    /// The velocity of each joint.
    Clock,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointLogLag {
    /// Whether each joint lags by a share of its own; else all by one.
    each: bool,
    #[serde(default)]
    by: Behind,
}

/// s: clocks farther apart belong to other postures altogether.
const LARGEST: f64 = 0.3;

impl JointLogLag {
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        if survey.moves() {
            // What a joint moves from one row to the next is its velocity: a share of it is a time, too.
            return vec![Hypothesis::new(Self { each: false, by: Behind::Clock }, 1).within(LARGEST)];
        }
        [false, true].map(|each| Hypothesis::new(Self { each, by: Behind::Move }, 2)).to_vec()
    }

    /// Whether it is the time between two clocks; else a share of the last move.
    pub fn is_time(&self) -> bool {
        self.by == Behind::Clock
    }
}

impl Effect for JointLogLag {
    fn name(&self) -> &'static str {
        "joint_log_lag"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let names: Vec<String> = (1..=robot.joints()).map(|joint| format!("share_j{joint}")).collect();
        match (self.by, self.each) {
            (Behind::Clock, _) => parameters(self, [("time", Unit::Second, 0.01)]),
            (Behind::Move, true) => parameters(self, names.iter().map(|name| (name.as_str(), Unit::One, 0.1))),
            (Behind::Move, false) => parameters(self, [("share", Unit::One, 0.1)]),
        }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for joint in 0..robot.joints() {
            match self.by {
                Behind::Clock => out.turn(0, p, joint, state.velocity(joint)),
                Behind::Move => out.turn(if self.each { joint } else { 0 }, p, joint, state.last_move(joint)),
            }
        }
    }
}

impl Placed for JointLogLag {
    fn place(&self) -> Place {
        Place::Recording
    }
}
