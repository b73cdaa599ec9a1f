//! `viscous_windup`: a moving joint trails behind in proportion to its speed, since viscous friction winds its gear up: d = -c dq/dt.
//!
//! c is the friction's coefficient over the gear's stiffness (s, or arcsec per deg/s). Standing targets know nothing of it.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ViscousWindup {
    joint: usize,
}

/// s: a joint that trails farther is not driven.
const LARGEST: f64 = 0.1;

impl ViscousWindup {
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        if !survey.moves() {
            return Vec::new();
        }
        let moving = |joint: &usize| survey.rows.iter().any(|row| survey.data.velocity(*row, *joint) != 0.0);
        let joints = (0..survey.joints()).filter(moving);
        joints.map(|joint| Hypothesis::new(Self { joint }, 1).positive().within(LARGEST)).collect()
    }
}

impl Effect for ViscousWindup {
    fn name(&self) -> &'static str {
        "viscous_windup"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let unit = if robot.is_revolute(self.joint) { Unit::RadianPerRadianPerSecond } else { Unit::Second };
        parameters(self, [("trail", unit, 0.01)])
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        out.turn(0, p, self.joint, -state.velocity(self.joint));
    }

    fn missing(&self, _robot: &RobotModel, data: &Measurements) -> Option<String> {
        data.velocity.is_none().then(|| "the recording has no joint velocities".into())
    }
}

impl Placed for ViscousWindup {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }
}
