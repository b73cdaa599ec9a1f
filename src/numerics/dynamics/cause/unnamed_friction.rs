//! Friction without a name: a smooth curve of speed, of which viscous and Coulomb friction are the straight line.

use super::unknown::UNKNOWN;
use super::{COULOMB, FittedNumber, TorqueCause, TorqueForm, VISCOUS, about, fill};
use crate::dynamics::scene::DynamicScene;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::PI;

/// Half a wave and a whole one of speed, up to the fastest (shape, rad/s), with the sign of the velocity, each without the straight line of
/// speed that is nearest to it over the recorded rows (two further numbers each): that line is viscous and Coulomb friction, which so are
/// those of the whole curve.
pub(super) struct UnnamedFriction;

/// Columns.
const WAVES: usize = 4;
/// Share of the fastest speed below which a joint hardly moves.
const STILL: f64 = 0.02;

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
            let fastest = scene.velocity[joint]
                .iter()
                .fold(1e-6, |most: f64, velocity| most.max(velocity.abs()));
            let speeds: Vec<f64> = scene.velocity[joint]
                .iter()
                .map(|v| v.abs() / fastest)
                .filter(|speed| *speed > STILL)
                .collect();
            let lines = (0..WAVES).flat_map(|column| line(&speeds, column));
            let shape: Vec<f64> = std::iter::once(fastest).chain(lines).collect();
            TorqueForm::at_joint(&UnnamedFriction, joint, WAVES).shaped(&shape)
        };
        (0..scene.joints()).map(form).collect()
    }

    fn write(
        &self,
        form: &TorqueForm,
        scene: &DynamicScene,
        _joint: usize,
        column: usize,
        out: &mut [f64],
    ) {
        let velocity = &scene.velocity[form.joint()];
        fill(out, |row| {
            scene.direction(form.joint(), row) * bent(form, column, velocity[row])
        });
    }

    fn friction(&self, form: &TorqueForm, column: usize, velocity: f64, sign: f64) -> Option<f64> {
        Some(sign * bent(form, column, velocity))
    }

    fn bends(&self, _form: &TorqueForm) -> bool {
        true
    }

    fn has_shape(&self, shape: &[f64]) -> bool {
        // Tables of before lines were taken off have none.
        shape.len() == 1 || shape.len() == 1 + 2 * WAVES
    }

    fn statement(&self, form: &TorqueForm, _fitted: &[FittedNumber]) -> String {
        format!(
            "friction without a name acts at {}: a curve of how fast the joint moves, of which viscous and Coulomb friction are the straight line",
            form.place
        )
    }
}

/// A wave of a speed, as a share of the fastest.
fn wave(column: usize, speed: f64) -> f64 {
    let phase = PI * [1.0, 2.0][column / 2] * speed;
    if column.is_multiple_of(2) {
        phase.sin()
    } else {
        phase.cos()
    }
}

/// A wave at a velocity without its line. Faster than any row it stays what it was at the fastest.
fn bent(form: &TorqueForm, column: usize, velocity: f64) -> f64 {
    let speed = (velocity.abs() / form.shape[0]).min(1.0);
    let line = form
        .shape
        .get(1 + 2 * column..3 + 2 * column)
        .map_or(0.0, |line| line[0] + line[1] * speed);
    wave(column, speed) - line
}

/// The line of speed nearest to a wave over some speeds: at none, and per share of the fastest.
fn line(speeds: &[f64], column: usize) -> [f64; 2] {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for speed in speeds {
        let row = Vector2::new(1.0, *speed);
        normal += row * row.transpose();
        right += row * wave(column, *speed);
    }
    normal
        .cholesky()
        .map_or([0.0; 2], |factor| factor.solve(&right).into())
}
