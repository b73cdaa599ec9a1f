//! `joint_compliance`: a joint winds up in proportion to its load (Eqs. 25-30); one parameter a revolute joint.
//!
//! The load is the gravity torque from the robot's masses (rad/Nm) or the motor current (rad/A), see [`Load`].

use super::{ArmState, Deflection, Effect, Hypothesis, Load, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JointCompliance {
    load: Load,
    /// One joint (from 0), or all that turn.
    joint: Option<usize>,
}

impl JointCompliance {
    /// Of every joint that turns.
    pub fn new(load: Load) -> Self {
        Self { load, joint: None }
    }

    /// Of one joint, from 0.
    pub fn of(joint: usize, load: Load) -> Self {
        Self { load, joint: Some(joint) }
    }

    fn joints(&self, robot: &RobotModel) -> impl Iterator<Item = usize> {
        let one = self.joint;
        (0..robot.joints()).filter(move |j| one.is_none_or(|joint| joint == *j)).filter(|j| robot.is_revolute(*j))
    }

    /// Every joint that gravity loads; by motor currents where the robot file has no masses to make a torque from.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let by_gravity = survey.revolute().filter(|joint| survey.is_loaded(*joint));
        let by_gravity = by_gravity.map(|joint| Hypothesis::new(Self::of(joint, Load::GravityTorque), 1).positive());
        let deaf = survey.robot.has_masses() || survey.data.current.is_none();
        let by_current = survey.revolute().filter(|_| !deaf);
        // The sign of a current is the controller's.
        let by_current = by_current.map(|joint| Hypothesis::new(Self::of(joint, Load::MotorCurrent), 2));
        by_gravity.chain(by_current).collect()
    }
}

impl Effect for JointCompliance {
    fn name(&self) -> &'static str {
        "joint_compliance"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let (unit, prior_sigma) = match self.load {
            Load::GravityTorque => (Unit::RadianPerNewtonMetre, 1e-3),
            Load::MotorCurrent => (Unit::RadianPerAmpere, 1e-2),
        };
        self.joints(robot)
            .map(|j| ParameterSpec {
                name: format!("joint_compliance.j{}", j + 1),
                place: format!("joint {}", j + 1),
                unit,
                prior_sigma,
            })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (parameter, joint) in self.joints(robot).enumerate() {
            let load = match self.load {
                Load::GravityTorque => state.torque()[joint],
                Load::MotorCurrent => match state.current().map(|all| all[joint]) {
                    Some(current) if current.is_finite() => current,
                    _ => 0.0,
                },
            };
            out.turn(parameter, p, joint, load);
            if self.load == Load::GravityTorque {
                out.yields(joint, p[parameter]);
            }
        }
    }

    fn needs_torque(&self) -> bool {
        self.load == Load::GravityTorque
    }

    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        match self.load {
            Load::MotorCurrent if data.current.is_none() => Some("the recording has no motor currents".into()),
            Load::GravityTorque if !robot.has_masses() && data.payload.iter().all(|mass| *mass == 0.0) => {
                Some("the robot file gives no link masses and no row carries a payload".into())
            }
            _ => None,
        }
    }
}

impl Placed for JointCompliance {
    fn place(&self) -> Place {
        Place::Joint(self.joint.unwrap_or(0))
    }
}
