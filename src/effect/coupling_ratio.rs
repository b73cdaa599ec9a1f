//! `coupling_ratio`: joint B moves with joint A by more than the controller believes; the parameter is h of Eq. 14, times k_A.
//!
//! One parameter for each coupling that the robot file declares.

use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Measurements, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

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

/// One coupling that the robot file does not declare.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairRatio {
    by: usize,
    moved: usize,
}

/// Joints further apart than neighbours hardly drive each other: -2 ln of the odds.
const DISTANT: f64 = 6.0;

impl PairRatio {
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let declared = |by, moved| survey.robot.description().couplings.iter().any(|c| c.by == by && c.moved == moved);
        let n = survey.joints();
        let pairs = (0..n).flat_map(|by| (0..n).map(move |moved| (by, moved)));
        pairs
            .filter(|(by, moved)| by != moved && !declared(*by, *moved))
            .map(|(by, moved)| {
                let charge = if by.abs_diff(moved) == 1 { 0.0 } else { DISTANT };
                Hypothesis::new(Self { by, moved }, 1).charged(charge)
            })
            .collect()
    }
}

impl Effect for PairRatio {
    fn name(&self) -> &'static str {
        "coupling_ratio"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        super::form::parameters(self, [("", Unit::One, 0.01)])
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        out.turn(0, p, self.moved, state.q[self.by]);
    }
}

impl Placed for PairRatio {
    fn place(&self) -> Place {
        Place::Coupled(self.by, self.moved)
    }
}
