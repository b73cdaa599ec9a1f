//! Friction that is greater at low speed and falls as the joint gets faster.

use super::{
    COULOMB, FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint_with, fill,
};
use crate::dynamics::scene::DynamicScene;

/// sgn v exp(-|v| / vs) (Armstrong-Helouvry, 1994).
pub(super) struct Stribeck;

/// rad/s: the one that stands in the rich model, and all that are tried.
const USUAL: f64 = 0.1;
/// Widths of the sign.
const NARROWEST: f64 = 2.0;
const SPEEDS: [&[f64]; 8] = [
    &[0.05, 1.0],
    &[0.07, 1.0],
    &[USUAL, 1.0],
    &[0.15, 1.0],
    &[0.25, 1.0],
    &[0.06, 2.0],
    &[USUAL, 2.0],
    &[0.17, 2.0],
];
/// Exponent of speed over its scale: 1 as a rule, found between these (Armstrong-Helouvry, 1991, reports 0.5 to 2).
const EXPONENTS: [f64; 2] = [0.4, 2.5];

impl TorqueCause for Stribeck {
    about! {
        name: "stribeck_friction",
        coefficients: &[("stribeck", "Nm")],
        of_sign: true,
        modifies: &[COULOMB],
        positive: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint_with(&Stribeck, scene, 1, &SPEEDS)
    }

    fn price(&self, form: &TorqueForm) -> f64 {
        if form.shape.get(1).is_none_or(|exponent| *exponent == 1.0) {
            6.0
        } else {
            10.0
        }
    }

    /// What falls within the width over which the sign turns is a sign of another width.
    fn is_itself(&self, form: &TorqueForm, scene: &DynamicScene) -> bool {
        form.shape[0] > NARROWEST * scene.width_at(form.joint())
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.shape == [USUAL, 1.0]
    }

    fn spans(&self, _form: &TorqueForm) -> Vec<ShapeSpan> {
        let [least, most] = EXPONENTS;
        let exponent = ShapeSpan {
            name: "exponent",
            unit: "1",
            index: 1,
            least,
            most,
            by_ratio: true,
            usual: Some(1.0),
        };
        let speed = ShapeSpan {
            name: "speed",
            unit: "rad/s",
            index: 0,
            least: 0.02,
            most: 0.5,
            by_ratio: true,
            usual: None,
        };
        vec![speed, exponent, speed]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        _column: usize,
        out: &mut [f64],
    ) {
        let velocity = &scene.velocity[form.joint()];
        fill(out, |row| {
            scene.direction(form.joint(), row) * falls(form, velocity[row])
        });
    }

    fn friction(&self, form: &TorqueForm, _column: usize, velocity: f64, sign: f64) -> Option<f64> {
        Some(sign * falls(form, velocity))
    }

    fn bends(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let [value, speed] = [fitted[0].value, form.shape[0]];
        format!(
            "friction of {} is {value:.3} Nm greater when it begins to move, which falls over {speed:.3} rad/s",
            form.place
        )
    }
}

/// The share that is left at a velocity of what it is when the joint begins to move.
fn falls(form: &TorqueForm, velocity: f64) -> f64 {
    let speeds = velocity.abs() / form.shape[0];
    match form.shape.get(1) {
        Some(exponent) if *exponent != 1.0 => (-speeds.powf(*exponent)).exp(),
        _ => (-speeds).exp(),
    }
}
