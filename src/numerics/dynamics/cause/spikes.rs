//! Lost motion: a knock after each reversal of a joint.

use super::{FittedNumber, ShapeSpan, TorqueCause, TorqueForm, about, at_each_joint_with};
use crate::dynamics::scene::DynamicScene;

/// (t / T) exp(1 - t / T) after a reversal, with the new direction's sign.
pub(super) struct Spikes;

/// s: the one that stands in the rich model, and all that are tried.
const USUAL: f64 = 0.05;
const TIMES: [&[f64]; 4] = [&[0.03], &[USUAL], &[0.08], &[0.12]];
/// rad/s below which a direction does not count.
const REST: f64 = 0.006;
/// Beyond so many times T nothing is left.
const OVER: f64 = 20.0;

impl TorqueCause for Spikes {
    about! { name: "backlash_spikes", coefficients: &[("height", "Nm")], price: 25.0, positive: true }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint_with(&Spikes, scene, 1, &TIMES)
    }

    fn is_rich(&self, form: &TorqueForm) -> bool {
        form.shape == [USUAL]
    }

    fn spans(&self, _form: &TorqueForm) -> Vec<ShapeSpan> {
        vec![ShapeSpan {
            name: "time",
            unit: "s",
            index: 0,
            least: 0.01,
            most: 0.3,
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
        let (velocity, lasting) = (&scene.velocity[form.joint()], form.shape[0]);
        out.fill(0.0);
        for stretch in &scene.stretches {
            let mut direction = 0.0;
            for row in stretch.clone() {
                let now = if velocity[row].abs() > REST {
                    velocity[row].signum()
                } else {
                    0.0
                };
                if now == 0.0 || now == direction {
                    continue;
                }
                direction = now;
                let end = stretch
                    .end
                    .min(row + (OVER * lasting * scene.rate) as usize + 1);
                for (step, value) in out[row..end].iter_mut().enumerate() {
                    let share = step as f64 / scene.rate / lasting;
                    *value += now * share * (1.0 - share).exp();
                }
            }
        }
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let [value, time] = [fitted[0].value, form.shape[0]];
        format!(
            "each reversal of {} knocks with {value:.3} Nm, {time:.3} s later: lost motion",
            form.place
        )
    }
}
