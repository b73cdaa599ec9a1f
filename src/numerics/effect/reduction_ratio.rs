//! `reduction_ratio`: output angle scaled by k_i; the parameter is k_i - 1.
//!
//! Eq. 14 with the erratum: d theta_i = (k_i - 1)(theta_i - sum_j c_ij theta_j) + sum_j c_ij (k_j - 1) theta_j, c the nominal
//! coupling that the controller already corrects for.

use super::{ArmState, Cause, Deflection, Effect, ParameterSpec, Place, about, names};
use crate::robot::RobotModel;
use crate::units::Unit;

/// Joints that travel more or less than reported, in proportion.
#[derive(Debug, Clone, Copy)]
pub struct ReductionRatio;

impl Cause for ReductionRatio {
    about! {
        name: names::REDUCTION_RATIO,
        place: "joint",
        formula: "d = c q",
        size: "1e-5 to 1e-3",
        confounded: "joint_compliance, gear_cyclic of order 1",
        needs: "a wide travel of the joint",
        arm_effect: Some(|_| Box::new(ReductionRatio)),
    }
}

impl Effect for ReductionRatio {
    fn name(&self) -> &'static str {
        names::REDUCTION_RATIO
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        (0..robot.joints())
            .map(|j| ParameterSpec {
                name: format!("reduction_ratio.j{}", j + 1),
                place: Place::Joint(j),
                unit: Unit::One,
                prior_sigma: 0.01,
            })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let couplings = &robot.description().couplings;
        for joint in 0..robot.joints() {
            let coupled: f64 = couplings.iter().filter(|c| c.moved == joint).map(|c| c.ratio * state.q[c.by]).sum();
            out.turn(joint, p, joint, state.q[joint] - coupled);
        }
        for coupling in couplings.iter().filter(|c| c.ratio != 0.0) {
            out.turn(coupling.by, p, coupling.moved, coupling.ratio * state.q[coupling.by]);
        }
    }
}
