//! Friction that turns with the direction of motion only after a travel, and is kept at rest.

use super::{COULOMB, FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint_with};
use crate::dynamics::scene::DynamicScene;

/// z - sgn v with z' = (v - |v| z) / travel (Dahl, 1968); where bristles differ, the same over a longer travel, too.
pub(super) struct PreslidingFriction;

/// rad: the one that stands in the rich model, and all that are tried.
const USUAL: f64 = 0.004;
/// The longer travel over the other one.
const LONGER: f64 = 4.0;
const TRAVELS: [&[f64]; 5] = [&[0.0006], &[0.0015], &[USUAL], &[0.01], &[0.025]];
/// rad/s below which a joint is at rest.
const REST: f64 = 2e-3;

impl TorqueCause for PreslidingFriction {
    about! {
        name: "presliding_friction",
        coefficients: &[("kept", "Nm"), ("kept_longer", "Nm")],
        price: 25.0,
        of_sign: true,
        modifies: &[COULOMB],
        positive: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        [1, 2]
            .into_iter()
            .flat_map(|width| at_each_joint_with(&PreslidingFriction, scene, width, &TRAVELS))
            .collect()
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.width == 1 && form.shape == [USUAL]
    }

    fn spans(&self, _form: &TorqueForm) -> Vec<ShapeSpan> {
        vec![ShapeSpan {
            name: "travel",
            unit: "rad",
            index: 0,
            least: 3e-4,
            most: 0.05,
            by_ratio: true,
            usual: None,
        }]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let velocity = &scene.velocity[form.joint()];
        let travel = form.shape[0] * if column == 0 { 1.0 } else { LONGER };
        for stretch in &scene.stretches {
            let mut kept = 0.0;
            for row in stretch.clone() {
                let moved = if velocity[row].abs() > REST {
                    velocity[row] / scene.rate
                } else {
                    0.0
                };
                if moved != 0.0 {
                    kept = moved.signum() + (kept - moved.signum()) * (-moved.abs() / travel).exp();
                }
                out[row] = kept - scene.direction(form.joint(), row);
            }
        }
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let value: f64 = fitted.iter().map(|kept| kept.value).sum();
        let travel = form.shape[0];
        format!(
            "friction of {} turns over a travel of {travel:.2e} rad and is kept at rest, {value:.3} Nm of it",
            form.place
        )
    }
}
