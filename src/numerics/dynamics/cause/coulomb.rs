//! Friction of one size against the direction of motion.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Its name.
pub const COULOMB: &str = "coulomb_friction";

/// Friction of one size against the direction of motion.
pub(super) struct Coulomb;

impl TorqueCause for Coulomb {
    fn name(&self) -> &'static str {
        COULOMB
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Coulomb, scene, 1)
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        0.0
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn is_of_sign(&self) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let joint = form.joint();
        fill(out, |row| scene.direction(joint, row));
    }

    fn friction(&self, _form: &TorqueForm, _velocity: f64, sign: f64) -> Option<f64> {
        Some(sign)
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("coulomb", "Nm")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("coulomb", fitted[0], "Nm")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("{} has Coulomb friction of {:.3} Nm", form.place, fitted[0].value)
    }
}
