//! A current that makes another torque than declared.

use super::{FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint, fill};
use crate::dynamics::scene::DynamicScene;

/// Its name.
pub(crate) const TORQUE_CONSTANT: &str = "torque_constant";

/// A current that makes another torque than declared. With a shape (Nm, and the largest torque of the joint) the difference falls with
/// torque, to half at so many Nm: iron saturates, and a table of a drive is right at its rated current.
pub(super) struct TorqueConstant;

/// Shares of the largest torque.
const HALVES: [f64; 2] = [0.25, 1.0];
const HALF_SPAN: [f64; 2] = [0.1, 4.0];

/// Share of the declared one: more is no error of a drive.
const MOST: f64 = 0.6;

impl TorqueCause for TorqueConstant {
    about! {
        name: TORQUE_CONSTANT,
        coefficients: &[("relative", "1")],
        inertial: true,
        of_rigid: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        // Beside identified masses it is a part of them.
        let Some(_) = scene.declared else {
            return Vec::new();
        };
        let largest = |joint: usize| {
            scene.rigid[joint]
                .iter()
                .fold(1e-9, |most: f64, torque| most.max(torque.abs()))
        };
        let falling = |joint: usize| {
            HALVES.map(|half| {
                TorqueForm::at_joint(&TorqueConstant, joint, 1)
                    .shaped(&[half * largest(joint), largest(joint)])
            })
        };
        at_each_joint(&TorqueConstant, scene, 1)
            .into_iter()
            .chain((0..scene.joints()).flat_map(falling))
            .collect()
    }

    fn price(&self, form: &TorqueForm) -> f64 {
        if form.shape.is_empty() { 4.0 } else { 10.0 }
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.shape.is_empty()
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        let span = |largest: &f64| {
            let [least, most] = HALF_SPAN.map(|share| share * largest);
            ShapeSpan {
                name: "half_at",
                unit: "Nm",
                index: 0,
                least,
                most,
                by_ratio: true,
                usual: None,
            }
        };
        form.shape.get(1).map(span).into_iter().collect()
    }

    fn is_possible(&self, _form: &TorqueForm, values: &[f64]) -> bool {
        values[0].abs() < MOST
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
        match form.shape.first() {
            None => out.copy_from_slice(&scene.rigid[joint]),
            // A drive makes the torque of friction too, which so depends on load.
            Some(half) => fill(out, |row| {
                let torque = scene.rigid[joint][row] + scene.friction[joint][row];
                torque / (1.0 + torque.abs() / half)
            }),
        }
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let (place, percent) = (form.place, 100.0 * fitted[0].value);
        match form.shape.first() {
            None => format!(
                "torques of {place} read {percent:+.1} % off: its torque constant is not the declared one"
            ),
            Some(half) => format!(
                "small torques of {place} read {percent:+.1} % off, half of that at {half:.3} Nm: its torque constant is not the declared one"
            ),
        }
    }
}
