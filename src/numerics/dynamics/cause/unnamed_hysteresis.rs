//! Drag without a name that turns over only after a travel of a good part of a radian: hoses and cable guides that bend with their joint.

use super::unknown::UNKNOWN;
use super::{FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint_with};
use crate::dynamics::scene::DynamicScene;

/// Exponential over a travel after each reversal, kept at rest; shape: travel, least and greatest one, rad.
pub(super) struct UnnamedHysteresis;

/// rad.
const SPAN: [f64; 2] = [0.05, 1.0];
const TRAVELS: [f64; 3] = [0.08, 0.2, 0.5];

impl TorqueCause for UnnamedHysteresis {
    about! {
        name: UNKNOWN,
        coefficients: &[("kept", "Nm")],
        price: 30.0,
        positive: true,
        may_repeat: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let shapes = TRAVELS.map(|travel| [travel, SPAN[0], SPAN[1]]);
        at_each_joint_with(
            &UnnamedHysteresis,
            scene,
            1,
            &shapes.each_ref().map(|shape| &shape[..]),
        )
    }

    fn spans(&self, form: &TorqueForm) -> Vec<ShapeSpan> {
        vec![ShapeSpan {
            name: "travel",
            unit: "rad",
            index: 0,
            least: form.shape[1],
            most: form.shape[2],
            by_ratio: true,
            usual: None,
        }]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        _column: usize,
        out: &mut [f64],
    ) {
        let (position, travel) = (&scene.position[form.joint()], form.shape[0]);
        for stretch in &scene.stretches {
            let (mut kept, mut before) = (0.0, position[stretch.start]);
            for row in stretch.clone() {
                let moved = position[row] - before;
                before = position[row];
                if moved != 0.0 {
                    kept = moved.signum() + (kept - moved.signum()) * (-moved.abs() / travel).exp();
                }
                out[row] = kept;
            }
        }
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 3
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        let [place, travel] = [form.place.to_string(), format!("{:.3}", form.shape[0])];
        format!(
            "something without a name drags at {place} and turns over only after a travel of {travel} rad"
        )
    }
}
