//! Friction that grows with the velocity of a joint.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Its name.
pub(in crate::dynamics) const VISCOUS: &str = "viscous_friction";

/// Friction that grows with the velocity of a joint.
pub(super) struct Viscous;

impl TorqueCause for Viscous {
    fn name(&self) -> &'static str {
        VISCOUS
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Viscous, scene, 1)
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        0.0
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let joint = form.joint();
        fill(out, |row| scene.velocity[joint][row]);
    }

    fn friction(&self, _form: &TorqueForm, velocity: f64, _sign: f64) -> Option<f64> {
        Some(velocity)
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("viscous", "Nm s/rad")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("viscous", fitted[0], "Nm s/rad")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("{} has viscous friction of {:.3} Nm s/rad", form.place, fitted[0].value)
    }
}
