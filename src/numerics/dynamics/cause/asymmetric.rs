//! Friction that is greater in one direction of motion.

use super::{COULOMB, CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Friction that is greater in one direction of motion.
pub(super) struct Asymmetric;

impl TorqueCause for Asymmetric {
    fn name(&self) -> &'static str {
        "asymmetric_friction"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Asymmetric, scene, 1)
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        6.0
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn modifies(&self) -> &'static [&'static str] {
        &[COULOMB]
    }

    fn is_of_sign(&self) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let joint = form.joint();
        fill(out, |row| scene.direction(joint, row).max(0.0));
    }

    fn friction(&self, _form: &TorqueForm, _velocity: f64, sign: f64) -> Option<f64> {
        Some(sign.max(0.0))
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("asymmetry", "Nm")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("asymmetry", fitted[0], "Nm")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("friction of {} is {:.3} Nm greater in its positive direction", form.place, fitted[0].value)
    }
}
