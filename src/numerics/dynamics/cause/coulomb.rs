//! Friction of one size against the direction of motion.

use super::{FittedNumber, TorqueCause, TorqueForm, about, at_each_joint, fill};
use crate::dynamics::scene::DynamicScene;

/// Its name.
pub const COULOMB: &str = "coulomb_friction";

/// Friction of one size against the direction of motion.
pub(super) struct Coulomb;

impl TorqueCause for Coulomb {
    about! {
        name: COULOMB,
        coefficients: &[("coulomb", "Nm")],
        price: 0.0,
        of_sign: true,
        rich: true,
        brakes: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Coulomb, scene, 1)
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
        fill(out, |row| scene.direction(joint, row));
    }

    fn friction(
        &self,
        _form: &TorqueForm,
        _column: usize,
        _velocity: f64,
        sign: f64,
    ) -> Option<f64> {
        Some(sign)
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!(
            "{} has Coulomb friction of {:.3} Nm",
            form.place, fitted[0].value
        )
    }
}
