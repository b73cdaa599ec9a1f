//! `link_mass`: mass or centre of a link in the torque model is wrong, as its first moments (kg m); seen through compliance.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Burden, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinkMass {
    /// From 0.
    link: usize,
}

impl LinkMass {
    pub fn new(link: usize) -> Self {
        Self { link }
    }

    /// Every link carried by a joint that yields in the present model.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let carried = |link: &usize| (0..=*link).any(|joint| survey.yielding[joint] > 0.0);
        (1..survey.joints()).filter(carried).map(|link| Hypothesis::new(Self { link }, 1).charged(4.0)).collect()
    }
}

impl Effect for LinkMass {
    fn name(&self) -> &'static str {
        "link_mass"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        parameters(self, ["x", "y", "z"].map(|axis| (axis, Unit::KilogramMetre, 1e4)))
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        for joint in 0..=self.link {
            let torque = state.posture.torque_of_moment(robot, joint, self.link);
            for axis in 0..3 {
                out.load(axis, joint, torque[axis]);
            }
        }
    }

    fn needs_torque(&self) -> bool {
        true
    }

    fn burden(&self, _q: &[f64], _payload: f64, p: &[f64], out: &mut Burden) {
        out.body_moment[self.link] += Vector3::new(p[0], p[1], p[2]);
    }
}

impl Placed for LinkMass {
    fn place(&self) -> Place {
        Place::Links(self.link, self.link)
    }
}
