//! What has no name: a smooth torque at a joint, in the angles of two joints or in its own speed.

use super::{FittedNumber, TorqueCause, TorqueForm, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;
use std::f64::consts::PI;

/// Its name.
pub(in crate::dynamics) const UNKNOWN: &str = "unknown";

/// Products of sine and cosine of one angle and of twice another, `with` holds the two joints; or friction as waves of speed, half a wave and
/// a whole one up to the fastest, where `with` holds the joint twice.
pub(super) struct Unnamed;

impl Unnamed {
    /// Whether a form is friction by speed.
    fn is_of_speed(form: &TorqueForm) -> bool {
        form.with[0] == form.with[1]
    }
}

impl TorqueCause for Unnamed {
    fn name(&self) -> &'static str {
        UNKNOWN
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let n = scene.joints();
        let mut forms = Vec::new();
        for joint in 0..n {
            let fastest = scene.velocity[joint].iter().fold(0.0, |most: f64, velocity| most.max(velocity.abs()));
            forms.push(TorqueForm { with: [joint; 2], ..TorqueForm::at_joint(&Unnamed, joint, 4).shaped(&[fastest.max(1e-6)]) });
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
        if Self::is_of_speed(form) {
            let velocity = &scene.velocity[form.joint()];
            let waves = [1.0, 2.0][column / 2];
            let phase = |row: usize| PI * waves * velocity[row].abs() / form.shape[0];
            let wave = |row: usize| if column % 2 == 0 { phase(row).sin() } else { phase(row).cos() };
            return fill(out, |row| scene.sign(velocity[row]) * wave(row));
        }
        let [first, second] = form.with.map(|joint| &scene.position[joint]);
        match column {
            0 => fill(out, |row| first[row].sin() * (2.0 * second[row]).sin()),
            1 => fill(out, |row| first[row].sin() * (2.0 * second[row]).cos()),
            2 => fill(out, |row| first[row].cos() * (2.0 * second[row]).sin()),
            _ => fill(out, |row| first[row].cos() * (2.0 * second[row]).cos()),
        }
    }

    fn parameters(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        let names = match Self::is_of_speed(form) {
            true => ["speed_sin", "speed_cos", "speed_sin_2", "speed_cos_2"],
            false => ["sin_sin", "sin_cos", "cos_sin", "cos_cos"],
        };
        names.iter().zip(fitted).map(|(name, value)| plain(name, *value, "Nm")).collect()
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        if Self::is_of_speed(form) {
            return format!("friction without a name acts at {}; it depends on how fast the joint moves", form.place);
        }
        let [first, second] = form.with.map(|joint| joint + 1);
        format!("something without a name acts at {}; it depends on the angles of joint {first} and joint {second}", form.place)
    }
}
