//! Friction that is greater in one direction of motion.

use super::{COULOMB, FittedNumber, TorqueCause, TorqueForm, about, at_each_joint, fill};
use crate::dynamics::scene::DynamicScene;

/// Friction that is greater in one direction of motion.
pub(super) struct Asymmetric;

impl TorqueCause for Asymmetric {
    about! {
        name: "asymmetric_friction",
        coefficients: &[("asymmetry", "Nm")],
        of_sign: true,
        rich: true,
        modifies: &[COULOMB],
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Asymmetric, scene, 1)
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
        fill(out, |row| scene.direction(joint, row).max(0.0));
    }

    fn friction(
        &self,
        _form: &TorqueForm,
        _column: usize,
        _velocity: f64,
        sign: f64,
    ) -> Option<f64> {
        Some(sign.max(0.0))
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let (size, side) = (
            fitted[0].value.abs(),
            if fitted[0].value < 0.0 {
                "negative"
            } else {
                "positive"
            },
        );
        format!(
            "friction of {} is {size:.3} Nm greater in its {side} direction",
            form.place
        )
    }
}
