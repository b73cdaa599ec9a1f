//! `base_shift` and `tool_shift`: the mounting of the base or of the measured target steps at some time.

use super::form::parameters;
use super::zero_shift::CHANGES;
use super::{ArmState, Deflection, Effect, Form, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::spatial::Twist;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

/// What moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mounting {
    /// The base, only displaced.
    BaseDisplaced,
    /// The base, displaced and turned.
    BaseMoved,
    /// The target on the tool.
    Tool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameShift {
    mounting: Mounting,
    time_s: f64,
}

impl FrameShift {
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let mountings = [Mounting::BaseDisplaced, Mounting::BaseMoved, Mounting::Tool];
        let forms = survey.changes(CHANGES).flat_map(|time_s| mountings.map(|mounting| Self { mounting, time_s }));
        forms.map(|form| Hypothesis::new(form, survey.boundaries.len())).collect()
    }
}

/// The numbers of a rigid motion: displacement, and turn where it has one.
pub(super) const MOTION: [(&str, Unit, f64); 6] = [
    ("x", Unit::Millimetre, 0.1),
    ("y", Unit::Millimetre, 0.1),
    ("z", Unit::Millimetre, 0.1),
    ("rx", Unit::Radian, 0.1),
    ("ry", Unit::Radian, 0.1),
    ("rz", Unit::Radian, 0.1),
];

/// Unit twist number `k` about the origin.
pub(super) fn unit(k: usize) -> Twist {
    Twist::ith(k, 1.0)
}

impl Effect for FrameShift {
    fn name(&self) -> &'static str {
        if self.mounting == Mounting::Tool { "tool_shift" } else { "base_shift" }
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let count = if self.mounting == Mounting::BaseMoved { 6 } else { 3 };
        parameters(self, MOTION.into_iter().take(count))
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let after = f64::from(state.time() > self.time_s);
        let station = if self.mounting == Mounting::Tool { robot.joints() } else { 0 };
        for k in 0..if self.mounting == Mounting::BaseMoved { 6 } else { 3 } {
            out.shift(k, p, station, unit(k) * after);
        }
    }
}

impl Placed for FrameShift {
    fn place(&self) -> Place {
        if self.mounting == Mounting::Tool { Place::Tool } else { Place::Base }
    }

    fn near(&self, survey: &Survey, _level: i32) -> Vec<Form> {
        survey.changes_near(self.time_s).into_iter().map(|time_s| Self { mounting: self.mounting, time_s }.into()).collect()
    }
}
