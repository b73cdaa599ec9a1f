//! A balancer at the joint that arms balance: its torque swings with the joint's angle.

use super::spring::{BALANCED, SPRING_BALANCE_NAME};
use super::{FittedNumber, TorqueCause, TorqueForm, about, fill};
use crate::dynamics::scene::DynamicScene;

/// Shape: least and greatest angle of the joint, rad. Between two points a spring's lever is a sine of the angle: one wave a turn; where its force grows with its stroke (gas, a bent lever)
/// a second wave and a constant. A ripple of one wave a turn is the same torque: there it is a balancer, with the ripple as its rival.
pub(super) struct Balancer;

/// Columns without the second wave, with it, and with the constant.
const WIDTHS: [usize; 3] = [2, 4, 5];
/// Angles at which the torque is looked at, and its rms there over that of the first wave, at least.
const CHECKED: usize = 8;
const LEAST_WHOLE: f64 = 0.4;

/// The waves of an angle, column by column.
fn waves(q: f64) -> [f64; 5] {
    [q.cos(), q.sin(), (2.0 * q).cos(), (2.0 * q).sin(), 1.0]
}

impl TorqueCause for Balancer {
    about! {
        name: SPRING_BALANCE_NAME,
        coefficients: &[("cosine", "Nm"), ("sine", "Nm"), ("second_cosine", "Nm"), ("second_sine", "Nm"), ("constant", "Nm")],
        price: 2.0,
        of_angle: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let joints = (0..scene.joints()).filter(|joint| *joint == BALANCED);
        let ends = |joint: usize| {
            scene.position[joint]
                .iter()
                .fold([f64::MAX, f64::MIN], |[a, b], q| [a.min(*q), b.max(*q)])
        };
        joints
            .flat_map(|joint| {
                WIDTHS
                    .map(|width| TorqueForm::at_joint(&Balancer, joint, width).shaped(&ends(joint)))
            })
            .collect()
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let angle = &scene.position[form.joint()];
        fill(out, |row| waves(angle[row])[column]);
    }

    /// The second wave only bends the first: what is left of two that cancel each other where the joint moves is another torque.
    fn is_possible(&self, form: &TorqueForm, values: &[f64]) -> bool {
        let &[least, most] = &form.shape[..] else {
            return true;
        };
        let angles = || (0..=CHECKED).map(|k| least + (most - least) * k as f64 / CHECKED as f64);
        let square = |count: usize| {
            let torque = |q: f64| {
                waves(q)
                    .iter()
                    .zip(&values[..count])
                    .map(|(wave, value)| wave * value)
                    .sum::<f64>()
            };
            angles().map(|q| torque(q).powi(2)).sum::<f64>()
        };
        square(values.len()) >= LEAST_WHOLE * LEAST_WHOLE * square(values.len().min(WIDTHS[0]))
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 2
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let size = fitted[0].value.hypot(fitted[1].value);
        // -size sin(q - zero).
        let zero = fitted[0].value.atan2(-fitted[1].value).to_degrees();
        format!(
            "a balancing spring acts on {} with up to {size:.3} Nm; it pulls towards {zero:.0} deg",
            form.place
        )
    }
}
