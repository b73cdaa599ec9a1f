//! A constant torque that no mass explains: the zero of a current or torque sensor.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, at_each_joint, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// Its name.
pub(in crate::dynamics) const OFFSET: &str = "current_offset";

/// A constant torque that no mass explains: the zero of a current or torque sensor.
pub(super) struct Offset;

impl TorqueCause for Offset {
    fn name(&self) -> &'static str {
        OFFSET
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&Offset, scene, 1)
    }

    fn price(&self, _form: &TorqueForm) -> f64 {
        0.0
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn write(&self, _form: &TorqueForm, _scene: &DynamicScene, _joint: usize, _column: usize, out: &mut [f64]) {
        out.fill(1.0);
    }

    fn is_of_angle(&self) -> bool {
        true
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("offset", "Nm")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("offset", fitted[0], "Nm")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!("the torque of {} reads {:.3} Nm too much, whatever it does", form.place, fitted[0].value)
    }
}
