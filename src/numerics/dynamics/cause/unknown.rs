//! What has no name: a smooth torque at a joint, in the angles of two joints.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Its name.
pub(in crate::dynamics) const UNKNOWN: &str = "unknown";

/// Products of sine and cosine of one angle and of twice another; `with` holds the two joints.
pub(super) struct Unnamed;

impl TorqueCause for Unnamed {
    fn name(&self) -> &'static str {
        UNKNOWN
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let n = scene.joints();
        let mut forms = Vec::new();
        for joint in 0..n {
            for first in 0..n {
                for second in (0..n).filter(|second| *second != first) {
                    forms.push(TorqueForm { with: [first, second], ..TorqueForm::at_joint(&Unnamed, joint, 4) });
                }
            }
        }
        forms
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        30.0
    }

    fn is_alike_at_joints(&self) -> bool {
        true
    }

    fn may_repeat(&self) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, column: usize, out: &mut [f64]) {
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

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("sin_sin", "Nm"), ("sin_cos", "Nm"), ("cos_sin", "Nm"), ("cos_cos", "Nm")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let names = ["sin_sin", "sin_cos", "cos_sin", "cos_cos"];
        names.iter().zip(fitted).map(|(name, value)| plain(name, *value, "Nm")).collect()
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        let [first, second] = form.with.map(|joint| joint + 1);
        format!("something without a name acts at {}; it depends on the angles of joint {first} and joint {second}", form.place)
    }
}
