//! A joint that swings: its torque is that of the rigid arm behind a resonance.

use super::{
    FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint_with, plain, shape,
};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;
use std::f64::consts::PI;

/// G tau - tau with G = w^2 / (s^2 + 2 z w s + w^2), and w s / (s^2 + 2 z w s + w^2) tau; shape: Hz and z. A damper beside the spring transmits
/// torque, 2 z of the second column; one that brakes the swinging side against the base does not.
pub(super) struct Elasticity;

const WIDTH: usize = 2;
/// The second coefficient, at most: twice the greatest z.
const TRANSMITTED: f64 = 1.2;

/// Least share of the rigid arm's torque that swings: all of it does, and at resonances (Hz) beyond what was filtered only the ratio of the
/// share to the resonance squared is seen.
const SWINGING: f64 = 0.5;
const SEEN: f64 = 15.0;
const HERTZ: [f64; 8] = [3.0, 4.0, 5.0, 6.0, 7.0, 8.5, 10.0, 12.0];
const DAMPING: [f64; 2] = [0.05, 0.15];

impl TorqueCause for Elasticity {
    about! {
        name: "joint_elasticity",
        coefficients: &[("share", "1"), ("transmitted_damping", "1")],
        price: 8.0,
        of_rigid: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let shapes: Vec<[f64; 2]> = HERTZ
            .iter()
            .flat_map(|hertz| DAMPING.map(|damping| [*hertz, damping]))
            .collect();
        let shapes: Vec<&[f64]> = shapes.iter().map(|shape| &shape[..]).collect();
        at_each_joint_with(&Elasticity, scene, WIDTH, &shapes)
    }

    fn is_possible(&self, form: &TorqueForm, values: &[f64]) -> bool {
        let least = if form.shape[0] > SEEN { 0.0 } else { SWINGING };
        values[0] > least
            && values
                .get(1)
                .is_none_or(|damping| damping.abs() <= TRANSMITTED * values[0])
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.shape == [5.0, 0.05] || form.shape == [8.5, 0.05]
    }

    fn spans(&self, _form: &TorqueForm) -> Vec<ShapeSpan> {
        let hertz = ShapeSpan {
            name: "resonance",
            unit: "Hz",
            index: 0,
            least: 2.0,
            most: 20.0,
            by_ratio: true,
            usual: None,
        };
        vec![
            hertz,
            ShapeSpan {
                name: "damping",
                unit: "1",
                index: 1,
                least: 0.005,
                most: 0.6,
                by_ratio: true,
                usual: None,
            },
            hertz,
        ]
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let (torque, rate, damping) = (&scene.rigid[form.joint()], scene.rate, form.shape[1]);
        // Bilinear, with the resonance where it is said to be.
        let w = 2.0 * rate * (PI * form.shape[0] / rate).tan();
        let k = 2.0 * rate;
        let (d1, d0) = (2.0 * damping * w, w * w);
        let d = k * k + d1 * k + d0;
        let b = if column == 0 {
            [d0 / d, 2.0 * d0 / d, d0 / d]
        } else {
            [w * k / d, 0.0, -w * k / d]
        };
        let a = [2.0 * (d0 - k * k) / d, (k * k - d1 * k + d0) / d];
        let rigid = if column == 0 { 1.0 } else { 0.0 };
        for stretch in &scene.stretches {
            let first = torque[stretch.start];
            let mut state = [0.0; 2];
            for row in stretch.clone() {
                let input = torque[row] - first;
                let output = b[0] * input + state[0];
                state = [
                    b[1] * input - a[0] * output + state[1],
                    b[2] * input - a[1] * output,
                ];
                out[row] = output - rigid * input;
            }
        }
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let [hertz, damping] = [
            shape("resonance", form.shape[0], "Hz"),
            shape("damping", form.shape[1], "1"),
        ];
        vec![
            hertz,
            damping,
            plain("share", fitted[0], "1"),
            plain("transmitted_damping", fitted[1], "1"),
        ]
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        let [hertz, damping] = [form.shape[0], form.shape[1]];
        format!(
            "{} swings at {hertz:.1} Hz with a damping ratio of {damping:.2}",
            form.place
        )
    }
}
