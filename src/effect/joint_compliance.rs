//! `joint_compliance`: a joint winds up in proportion to its load (Eqs. 25-30); one parameter a revolute joint.
//!
//! The load is the gravity torque from the robot's masses (rad/Nm) or the motor current (rad/A), see [`Load`].

use super::{ArmState, Deflection, Effect, Load, ParameterSpec};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;

#[derive(Debug, Clone, Copy)]
pub struct JointCompliance {
    load: Load,
}

impl JointCompliance {
    pub fn new(load: Load) -> Self {
        Self { load }
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
        (0..robot.joints())
            .filter(|j| robot.is_revolute(*j))
            .map(|j| ParameterSpec {
                name: format!("joint_compliance.j{}", j + 1),
                place: format!("joint {}", j + 1),
                unit,
                prior_sigma,
            })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (parameter, joint) in (0..robot.joints()).filter(|j| robot.is_revolute(*j)).enumerate() {
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
