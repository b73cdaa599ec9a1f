//! Inertia of a motor and its gear, as the joint feels it.

use super::{FittedNumber, TorqueCause, TorqueForm, about, at_each_joint};
use crate::dynamics::scene::DynamicScene;

/// Its name.
pub(crate) const ROTOR: &str = "rotor_inertia";

/// Inertia of a motor and its gear, as the joint feels it.
pub(super) struct Rotor;

impl TorqueCause for Rotor {
    about! {
        name: ROTOR,
        coefficients: &[("inertia", "kg m2")],
        price: 2.0,
        rich: true,
        inertial: true,
        positive: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Rotor, scene, 1)
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        _column: usize,
        out: &mut [f64],
    ) {
        let joint = form.joint();
        out.copy_from_slice(&scene.acceleration[joint]);
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!(
            "the rotor of {} adds an inertia of {:.4} kg m2 at the joint",
            form.place, fitted[0].value
        )
    }
}
