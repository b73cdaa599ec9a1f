//! `link_mass`: mass (kg) and perhaps centre (first moments, kg m) of a link in the torque model are wrong; seen through compliance.

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
    /// Whether the centre is wrong too.
    centre: bool,
}

impl LinkMass {
    /// Every link carried by a joint that yields in the present model.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let carried = |link: &usize| (0..=*link).any(|joint| survey.yielding[joint] > 0.0);
        let known = |link: &usize| survey.robot.description().joints[*link].centre.is_some();
        let links = (1..survey.joints()).filter(carried).filter(known);
        let forms = links.flat_map(|link| [false, true].map(|centre| Self { link, centre }));
        forms.map(|form| Hypothesis::new(form, 2).charged(4.0)).collect()
    }
}

impl Effect for LinkMass {
    fn name(&self) -> &'static str {
        "link_mass"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let mass = ("mass", Unit::Kilogram, 1e4);
        let moments = ["x", "y", "z"].map(|axis| (axis, Unit::KilogramMetre, 1e4));
        if self.centre { parameters(self, std::iter::once(mass).chain(moments)) } else { parameters(self, [mass]) }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        for joint in 0..=self.link {
            out.load(0, joint, state.posture.torque_of_mass(robot, joint, self.link));
            if self.centre {
                let torque = state.posture.torque_of_moment(robot, joint, self.link);
                for axis in 0..3 {
                    out.load(axis + 1, joint, torque[axis]);
                }
            }
        }
    }

    fn needs_torque(&self) -> bool {
        true
    }

    fn burden(&self, _q: &[f64], _payload: f64, p: &[f64], out: &mut Burden) {
        out.body[self.link] += p[0];
        if self.centre {
            out.body_moment[self.link] += Vector3::new(p[1], p[2], p[3]);
        }
    }
}

impl Placed for LinkMass {
    fn place(&self) -> Place {
        Place::Links(self.link, self.link)
    }
}
