//! `coupling_ratio`: joint B moves with joint A by more than the controller believes; the parameter is h of Eq. 14, times k_A.
//!
//! One parameter for each coupling that the robot file declares.

use super::{ArmState, Deflection, Effect, ParameterSpec};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;

#[derive(Debug, Clone, Copy)]
pub struct CouplingRatio;

impl Effect for CouplingRatio {
    fn name(&self) -> &'static str {
        "coupling_ratio"
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        robot
            .description()
            .couplings
            .iter()
            .map(|c| ParameterSpec {
                name: format!("coupling_ratio.j{}_j{}", c.by + 1, c.moved + 1),
                place: format!("joint {}->{}", c.by + 1, c.moved + 1),
                unit: Unit::One,
                prior_sigma: 0.01,
            })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (parameter, coupling) in robot.description().couplings.iter().enumerate() {
            out.turn(parameter, p, coupling.moved, state.q[coupling.by]);
        }
    }

    fn missing(&self, robot: &RobotModel, _data: &Measurements) -> Option<String> {
        robot.description().couplings.is_empty().then(|| "the robot file declares no couplings".to_string())
    }
}
