//! `base_compliance`: the foundation tilts about the base origin under the arm's overturning moment; rad/Nm.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::spatial::screw;
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BaseCompliance {
    /// Two stiffnesses instead of one.
    two: bool,
}

impl BaseCompliance {
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let loaded = (0..survey.joints()).any(|joint| survey.is_loaded(joint));
        let forms = [false, true].into_iter().filter(|_| loaded).map(|two| Self { two });
        forms.map(|form| Hypothesis::new(form, 2).positive()).collect()
    }
}

impl Effect for BaseCompliance {
    fn name(&self) -> &'static str {
        "base_compliance"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let unit = Unit::RadianPerNewtonMetre;
        if self.two { parameters(self, [("x", unit, 1e-3), ("y", unit, 1e-3)]) } else { parameters(self, [("", unit, 1e-3)]) }
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let origin = Vector3::zeros();
        let moment = state.posture.moment(0, &origin);
        let down = Vector3::from(robot.description().gravity);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        // The two base axes that gravity has least of.
        let vertical = axes.iter().enumerate().max_by(|a, b| down.dot(a.1).abs().total_cmp(&down.dot(b.1).abs()));
        let vertical = vertical.map_or(2, |(axis, _)| axis);
        for (k, axis) in (0..3).filter(|axis| *axis != vertical).enumerate() {
            let tilt = screw(&(axes[axis] * moment[axis]), &origin);
            out.shift(if self.two { k } else { 0 }, p, 0, tilt);
        }
    }

    fn needs_torque(&self) -> bool {
        true
    }
}

impl Placed for BaseCompliance {
    fn place(&self) -> Place {
        Place::Base
    }
}
