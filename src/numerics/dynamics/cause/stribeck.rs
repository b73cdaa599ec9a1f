//! Friction that is greater at low speed and falls as the joint gets faster.

use super::{COULOMB, CoefficientName, FittedNumber, ShapeSpan, TorqueCause, TorqueForm, at_each_joint_with, fill, plain, shape};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// sgn v exp(-|v| / vs) (Armstrong-Helouvry, 1994).
pub(super) struct Stribeck;

/// rad/s: the one that stands in the rich model, and all that are tried.
const USUAL: f64 = 0.1;
/// Widths of the sign.
const NARROWEST: f64 = 2.0;
const SPEEDS: [&[f64]; 5] = [&[0.05], &[0.07], &[USUAL], &[0.15], &[0.25]];

impl TorqueCause for Stribeck {
    fn name(&self) -> &'static str {
        "stribeck_friction"
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint_with(&Stribeck, scene, 1, &SPEEDS)
    }

    fn modifies(&self) -> &'static [&'static str] {
        &[COULOMB]
    }

    /// What falls within the width over which the sign turns is a sign of another width.
    fn is_itself(&self, form: &TorqueForm, scene: &DynamicScene) -> bool {
        form.shape[0] > NARROWEST * scene.sign_widths[form.joint()]
    }

    fn is_positive(&self) -> bool {
        true
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.shape == [USUAL]
    }

    fn spans(&self, _form: &TorqueForm) -> Vec<ShapeSpan> {
        vec![ShapeSpan { index: 0, least: 0.02, most: 0.5, by_ratio: true }]
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        let velocity = &scene.velocity[form.joint()];
        fill(out, |row| scene.direction(form.joint(), row) * (-velocity[row].abs() / form.shape[0]).exp());
    }

    fn friction(&self, form: &TorqueForm, velocity: f64, sign: f64) -> Option<f64> {
        Some(sign * (-velocity.abs() / form.shape[0]).exp())
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("stribeck", "Nm")]
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("stribeck", fitted[0], "Nm"), shape("speed", form.shape[0], "rad/s")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let [value, speed] = [fitted[0].value, form.shape[0]];
        format!("friction of {} is {value:.3} Nm greater when it begins to move, which falls over {speed:.3} rad/s", form.place)
    }
}
