//! `joint_offset`: zero error of joint N, theta_i0 of Eq. 14; one parameter a joint.

use super::{ArmState, Cause, Deflection, Effect, ParameterSpec, Place, about, names};
use crate::robot::RobotModel;
use crate::units::Unit;

#[derive(Debug, Clone, Copy)]
pub struct JointOffset;

impl Cause for JointOffset {
    about! {
        name: names::JOINT_OFFSET,
        place: "joint",
        formula: "d = c",
        size: "0.1 to 5 mrad",
        confounded: "base_frame, link_geometry",
        needs: "-",
        arm_effect: Some(|_| Box::new(JointOffset)),
    }
}

impl Effect for JointOffset {
    fn name(&self) -> &'static str {
        names::JOINT_OFFSET
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        (0..robot.joints())
            .map(|j| ParameterSpec {
                name: format!("joint_offset.j{}", j + 1),
                place: Place::Joint(j),
                unit: if robot.is_revolute(j) { Unit::Radian } else { Unit::Millimetre },
                prior_sigma: 0.02,
            })
            .collect()
    }

    fn is_constant(&self) -> bool {
        true
    }

    fn deflect(&self, robot: &RobotModel, _state: &ArmState, p: &[f64], out: &mut Deflection) {
        for joint in 0..robot.joints() {
            out.turn(joint, p, joint, 1.0);
        }
    }
}
