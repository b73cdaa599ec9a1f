//! Inertia of a motor and its gear, as the joint feels it.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Its name.
pub(in crate::dynamics) const ROTOR: &str = "rotor_inertia";

/// Inertia of a motor and its gear, as the joint feels it.
pub(super) struct Rotor;

impl TorqueCause for Rotor {
    fn name(&self) -> &'static str {
        ROTOR
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Rotor, scene, 1)
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        2.0
    }

    fn is_positive(&self) -> bool {
        true
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn is_inertial(&self) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let joint = form.joint();
        out.copy_from_slice(&scene.acceleration[joint]);
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("inertia", "kg m2")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("inertia", fitted[0], "kg m2")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("the rotor of {} adds an inertia of {:.4} kg m2 at the joint", form.place, fitted[0].value)
    }
}
