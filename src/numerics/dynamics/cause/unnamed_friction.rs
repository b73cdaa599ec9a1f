//! Friction without a name: curves of speed, and friction that is greater at some angles.

use super::angle::{UNKNOWN, ends};
use super::friction::{COULOMB, VISCOUS};
use super::{ColumnTorque, PLAIN, TorqueCause, TorqueForm, plain, shape};
use crate::dynamics::scene::largest;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::PI;

/// Columns.
const WAVES: usize = 4;
/// Share of the fastest speed below which a joint hardly moves.
const STILL: f64 = 0.02;

/// A smooth curve of speed, of which viscous and Coulomb friction are the straight line: half a wave and a whole one of speed, up to the fastest
/// (shape, rad/s), with the sign of the velocity, each without the straight line of speed that is nearest to it over the recorded rows (two
/// further numbers each): that line is viscous and Coulomb friction, which so are those of the whole curve.
pub(super) static BY_SPEED: TorqueCause = TorqueCause {
    name: UNKNOWN,
    coefficients: &[
        ("half_wave_sin", "Nm"),
        ("half_wave_cos", "Nm"),
        ("wave_sin", "Nm"),
        ("wave_cos", "Nm"),
    ],
    price: |_| 30.0,
    of_sign: true,
    modifies: &[VISCOUS, COULOMB],
    may_repeat: true,
    bends: true,
    // Tables of before lines were taken off have none.
    lengths: &[1, 1 + 2 * WAVES],
    forms: |cause, scene| {
        let form = |joint: usize| {
            let fastest = largest(&scene.velocity[joint]).max(1e-6);
            let speeds = scene.velocity[joint].iter().map(|v| v.abs() / fastest);
            let speeds: Vec<f64> = speeds.filter(|speed| *speed > STILL).collect();
            let lines = (0..WAVES).flat_map(|column| line(&speeds, column));
            let shape: Vec<f64> = std::iter::once(fastest).chain(lines).collect();
            TorqueForm::at_joint(cause, joint, WAVES).shaped(&shape)
        };
        (0..scene.joints()).map(form).collect()
    },
    torque: ColumnTorque::Row(|column, row| {
        column.direction(row) * bent(column.form, column.column, column.velocity(row))
    }),
    friction: Some(|form, column, velocity, sign| sign * bent(form, column, velocity)),
    statement: |form, _| {
        format!(
            "friction without a name acts at {}: a curve of how fast the joint moves, of which viscous and Coulomb friction are the straight line",
            form.place
        )
    },
    ..PLAIN
};

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

/// Waves a turn.
const ORDERS: usize = 4;

/// Friction that is greater at some angles of its joint, as ways, seals and lubricant differ along a turn: so many waves a turn (`with`), with
/// the sign of the velocity; shape: least and greatest angle of the joint, rad.
pub(super) static BY_ANGLE: TorqueCause = TorqueCause {
    name: UNKNOWN,
    coefficients: &[("drag_cosine", "Nm"), ("drag_sine", "Nm")],
    price: |_| 30.0,
    of_sign: true,
    modifies: &[COULOMB],
    may_repeat: true,
    lengths: &[2],
    forms: |cause, scene| {
        let of = |joint: usize| {
            let ends = ends(scene, joint);
            (1..=ORDERS).map(move |order| TorqueForm {
                with: [order, 0],
                ..TorqueForm::at_joint(cause, joint, 2).shaped(&ends)
            })
        };
        (0..scene.joints()).flat_map(of).collect()
    },
    torque: ColumnTorque::Row(|column, row| {
        let turn = column.form.with[0] as f64 * column.angle(row);
        let wave = if column.column == 0 {
            turn.cos()
        } else {
            turn.sin()
        };
        column.direction(row) * wave
    }),
    parameters: |form, fitted| {
        vec![
            plain("drag_cosine", fitted[0], "Nm"),
            plain("drag_sine", fitted[1], "Nm"),
            shape("order", form.with[0] as f64, "1"),
        ]
    },
    statement: |form, _| {
        format!(
            "friction without a name acts at {} in addition to Coulomb friction; it depends on the angle of the joint",
            form.place
        )
    },
    ..PLAIN
};
