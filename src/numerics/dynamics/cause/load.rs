//! Friction that grows with the torque that a gear transmits.

use super::{COULOMB, FittedNumber, TorqueCause, TorqueForm, about, at_each_joint, fill};
use crate::dynamics::scene::DynamicScene;

/// Friction that grows with the torque that a gear transmits.
pub(super) struct LoadFriction;

impl TorqueCause for LoadFriction {
    about! {
        name: "load_friction",
        coefficients: &[("share", "1")],
        of_sign: true,
        rich: true,
        modifies: &[COULOMB],
        positive: true,
        of_rigid: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        at_each_joint(&LoadFriction, scene, 1)
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        _column: usize,
        out: &mut [f64],
    ) {
        let joint = form.joint();
        fill(out, |row| {
            scene.direction(joint, row) * scene.rigid[joint][row].abs()
        });
    }

    fn statement(&self, form: &TorqueForm, fitted: &[FittedNumber]) -> String {
        format!(
            "{} loses {:.1} % of the torque that it transmits to friction",
            form.place,
            100.0 * fitted[0].value
        )
    }
}
