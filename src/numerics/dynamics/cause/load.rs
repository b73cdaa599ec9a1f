//! Friction that grows with the torque that a gear transmits.

use super::{COULOMB, CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Friction that grows with the torque that a gear transmits.
pub(super) struct LoadFriction;

impl TorqueCause for LoadFriction {
    fn name(&self) -> &'static str {
        "load_friction"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&LoadFriction, scene, 1)
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        6.0
    }

    fn is_positive(&self) -> bool {
        true
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn modifies(&self) -> &'static [&'static str] {
        &[COULOMB]
    }

    fn is_of_rigid(&self) -> bool {
        true
    }

    fn is_of_sign(&self) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let joint = form.joint();
        fill(out, |row| scene.direction(joint, row) * scene.rigid[joint][row].abs());
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("share", "1")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("share", fitted[0], "1")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("{} loses {:.1} % of the torque that it transmits to friction", form.place, 100.0 * fitted[0].value)
    }
}
