//! `zero_shift`: the zero of a joint steps at some time: a collision, a slipped belt or coupling, a new mastering.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Form, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ZeroShift {
    joint: usize,
    time_s: f64,
}

/// Change points tried at first; the best is refined to every one.
pub(super) const CHANGES: usize = 40;

impl ZeroShift {
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let at = |joint: usize| survey.changes(CHANGES).map(move |time_s| Self { joint, time_s });
        let forms = (0..survey.joints()).flat_map(at);
        forms.map(|form| Hypothesis::new(form, survey.boundaries.len())).collect()
    }
}

impl Effect for ZeroShift {
    fn name(&self) -> &'static str {
        "zero_shift"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let unit = if robot.is_revolute(self.joint) { Unit::Radian } else { Unit::Millimetre };
        parameters(self, [("step", unit, 0.1)])
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        out.turn(0, p, self.joint, f64::from(state.time() > self.time_s));
    }
}

impl Placed for ZeroShift {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn near(&self, survey: &Survey, _level: i32) -> Vec<Form> {
        survey.changes_near(self.time_s).into_iter().map(|time_s| Self { joint: self.joint, time_s }.into()).collect()
    }
}
