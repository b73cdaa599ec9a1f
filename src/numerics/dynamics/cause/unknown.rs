//! What has no name: a smooth torque at a joint, in the angles of two joints.

use super::{FittedNumber, TorqueCause, TorqueForm, about, fill};
use crate::dynamics::scene::DynamicScene;

/// Its name.
pub(crate) const UNKNOWN: &str = "unknown";

/// Products of sine and cosine of one angle and of twice another; `with` holds the two joints.
pub(super) struct Unnamed;

impl TorqueCause for Unnamed {
    about! {
        name: UNKNOWN,
        coefficients: &[("sin_sin", "Nm"), ("sin_cos", "Nm"), ("cos_sin", "Nm"), ("cos_cos", "Nm")],
        price: 30.0,
        may_repeat: true,
        alike_at_joints: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let n = scene.joints();
        let mut forms = Vec::new();
        for joint in 0..n {
            for first in 0..n {
                for second in (0..n).filter(|second| *second != first) {
                    forms.push(TorqueForm {
                        with: [first, second],
                        ..TorqueForm::at_joint(&Unnamed, joint, 4)
                    });
                }
            }
        }
        forms
    }

    fn cell(&self, form: &TorqueForm) -> [usize; 2] {
        form.with
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let [first, second] = form.with.map(|joint| &scene.position[joint]);
        match column {
            0 => fill(out, |row| first[row].sin() * (2.0 * second[row]).sin()),
            1 => fill(out, |row| first[row].sin() * (2.0 * second[row]).cos()),
            2 => fill(out, |row| first[row].cos() * (2.0 * second[row]).sin()),
            _ => fill(out, |row| first[row].cos() * (2.0 * second[row]).cos()),
        }
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.is_empty()
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        let [first, second] = form.with.map(|joint| joint + 1);
        format!(
            "something without a name acts at {}; it depends on the angles of joint {first} and joint {second}",
            form.place
        )
    }
}
