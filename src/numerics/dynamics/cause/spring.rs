//! Torque that grows with the angle of a joint: a balancing spring at joint 2, a cable or hose elsewhere.

use super::{CoefficientName, FittedNumber, TorqueCause, TorqueForm, plain};
use crate::dynamics::scene::DynamicScene;
use crate::dynamics::types::TorqueParameter;

/// q and 1.
pub(super) struct SpringTorque {
    name: &'static str,
    balances: bool,
}

/// At the joint that arms balance.
pub(super) static SPRING_BALANCE: SpringTorque = SpringTorque { name: SPRING_BALANCE_NAME, balances: true };
/// Its name.
pub(super) const SPRING_BALANCE_NAME: &str = "spring_balance";
/// At the others.
pub(super) static CABLE_STIFFNESS: SpringTorque = SpringTorque { name: "cable_stiffness", balances: false };
/// From 0.
pub(super) const BALANCED: usize = 1;

impl TorqueCause for SpringTorque {
    fn name(&self) -> &'static str {
        self.name
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let cause: &'static dyn TorqueCause = if self.balances { &SPRING_BALANCE } else { &CABLE_STIFFNESS };
        let joints = (0..scene.joints()).filter(|joint| (*joint == BALANCED) == self.balances);
        joints.map(|joint| TorqueForm::at_joint(cause, joint, 2)).collect()
    }

    fn is_rich(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, column: usize, out: &mut [f64]) {
        match column {
            0 => out.copy_from_slice(&scene.position[form.joint()]),
            _ => out.fill(1.0),
        }
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.is_empty()
    }

    fn coefficients(&self) -> &'static [CoefficientName] {
        &[("stiffness", "Nm/rad"), ("at_zero", "Nm")]
    }

    fn parameters(&self, _form: &TorqueForm, fitted: &[FittedNumber]) -> Vec<TorqueParameter> {
        vec![plain("stiffness", fitted[0], "Nm/rad"), plain("at_zero", fitted[1], "Nm")]
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        let what = if self.balances { "a balancing spring" } else { "a cable or hose" };
        format!("{what} acts on {} with {:.3} Nm/rad and {:.3} Nm at zero", form.place, fitted[0].value, fitted[1].value)
    }
}
