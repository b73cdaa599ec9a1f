//! A balancer at the joint that arms balance: its torque swings with the joint's angle.

use super::spring::{BALANCED, SPRING_BALANCE_NAME};
use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, fill, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Between two points a spring's lever is a sine of the angle: one wave a turn; where its force grows with its stroke (gas, a bent lever)
/// a second wave and a constant. A ripple of one wave a turn is the same torque: there it is a balancer, with the ripple as its rival.
pub(super) struct Balancer;

/// Columns without and with the second wave.
const WIDTHS: [usize; 2] = [2, 5];

impl TorqueCause for Balancer {
    fn name(&self) -> &'static str {
        SPRING_BALANCE_NAME
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let joints = (0..scene.joints()).filter(|joint| *joint == BALANCED);
        joints.flat_map(|joint| WIDTHS.map(|width| TorqueForm::at_joint(&Balancer, joint, width).shaped(&[1.0]))).collect()
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, column: usize, out: &mut [f64]) {
        let (angle, waves) = (&scene.position[form.joint()], form.shape[0]);
        match column {
            0 => fill(out, |row| (waves * angle[row]).cos()),
            1 => fill(out, |row| (waves * angle[row]).sin()),
            2 => fill(out, |row| (2.0 * waves * angle[row]).cos()),
            3 => fill(out, |row| (2.0 * waves * angle[row]).sin()),
            _ => out.fill(1.0),
        }
    }

    fn is_of_angle(&self) -> bool {
        true
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 1
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("cosine", "Nm"), ("sine", "Nm"), ("second_cosine", "Nm"), ("second_sine", "Nm"), ("constant", "Nm")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        self.coefficients().iter().zip(fitted).map(|((name, unit), number)| plain(name, *number, unit)).collect()
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let size = fitted[0].value.hypot(fitted[1].value);
        // -size sin(q - zero).
        let zero = fitted[0].value.atan2(-fitted[1].value).to_degrees();
        format!("a balancing spring acts on {} with up to {size:.3} Nm; it pulls towards {zero:.0} deg", form.place)
    }
}
