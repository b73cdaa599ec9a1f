//! A current that stands for another torque than declared.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// A current that stands for another torque than declared.
pub(super) struct TorqueConstant;

/// Share of the declared one: more is no error of a drive.
const MOST: f64 = 0.6;

impl TorqueCause for TorqueConstant {
    fn name(&self) -> &'static str {
        "torque_constant"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        // Beside identified masses it is a part of them.
        if scene.declared.is_some() { at_each_joint(&TorqueConstant, scene, 1) } else { Vec::new() }
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        4.0
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn is_inertial(&self) -> bool {
        true
    }

    fn is_of_rigid(&self) -> bool {
        true
    }

    fn is_possible(&self, _form: &TorqueForm, values: &[f64]) -> bool {
        values[0].abs() < MOST
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let joint = form.joint();
        out.copy_from_slice(&scene.rigid[joint]);
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("relative", "1")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("relative", fitted[0], "1")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!(
            "torques of {} read {:+.1} % off: its torque constant is not the declared one",
            form.place,
            100.0 * fitted[0].value
        )
    }
}
