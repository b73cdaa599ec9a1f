//! Friction without a name: a smooth curve of speed beside viscous and Coulomb friction.

use super::unknown::UNKNOWN;
use super::{COULOMB, FittedNumber, TorqueCause, TorqueForm, VISCOUS, about, fill};
use crate::dynamics::scene::DynamicScene;
use std::f64::consts::PI;

/// Half a wave and a whole one of speed, up to the fastest (shape, rad/s), with the sign of the velocity.
pub(super) struct UnnamedFriction;

impl TorqueCause for UnnamedFriction {
    about! {
        name: UNKNOWN,
        coefficients: &[("half_wave_sin", "Nm"), ("half_wave_cos", "Nm"), ("wave_sin", "Nm"), ("wave_cos", "Nm")],
        price: 30.0,
        of_sign: true,
        modifies: &[VISCOUS, COULOMB],
        may_repeat: true,
    }

    fn forms(&self, scene: &DynamicScene) -> Vec<TorqueForm> {
        let form = |joint: usize| {
            let fastest = scene.velocity[joint].iter().fold(1e-6, |most: f64, velocity| most.max(velocity.abs()));
            TorqueForm::at_joint(&UnnamedFriction, joint, 4).shaped(&[fastest])
        };
        (0..scene.joints()).map(form).collect()
    }

    fn write(&self, form: &TorqueForm, scene: &DynamicScene, _joint: usize, column: usize, out: &mut [f64]) {
        let velocity = &scene.velocity[form.joint()];
        let waves = [1.0, 2.0][column / 2];
        // Faster than any row it stays what it was at the fastest.
        let phase = |row: usize| PI * waves * (velocity[row].abs() / form.shape[0]).min(1.0);
        let wave = |row: usize| if column.is_multiple_of(2) { phase(row).sin() } else { phase(row).cos() };
        fill(out, |row| scene.direction(form.joint(), row) * wave(row));
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        shape.len() == 1
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        format!(
            "friction without a name acts at {} beside viscous and Coulomb friction; it depends on how fast the joint moves",
            form.place
        )
    }
}
