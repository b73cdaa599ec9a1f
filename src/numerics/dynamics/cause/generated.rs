//! Torques without a name over whatever rows say: smooth curves of one variable at a joint.

use super::angle::UNKNOWN;
use super::friction::COULOMB;
use super::{ColumnOf, ColumnTorque, PLAIN, TorqueCause, TorqueForm};
use crate::recording::ends;
use crate::scene::DynamicScene;
use std::f64::consts::PI;

/// Variables of a curve, the first number of `with`; the second is the other joint of `ANGLE`.
const LOAD: usize = 0;
const ANGLE: usize = 1;
const TIME: usize = 2;
const TEMPERATURE: usize = 3;
/// Half waves of a curve, and of one over what only drifts.
const CURVE: usize = 4;
const DRIFT: usize = 2;
/// C over which a temperature must change.
const LEAST_WARMTH: f64 = 1.0;

/// A curve of the load of a joint, of the angle of another one, of time or of temperature: half waves over the variable's range, constant
/// beyond it; the constant is an offset. Shape: the ends of the range, then zeros: a stored model identifies the cause by the number of shape
/// values.
pub(super) static OVER_ROWS: TorqueCause = TorqueCause {
    name: UNKNOWN,
    follows: |form| match form.with[0] {
        LOAD => "load",
        ANGLE => "other angle",
        TIME => "time",
        _ => "temperature",
    },
    coefficients: &[
        ("curve_1", "Nm"),
        ("curve_2", "Nm"),
        ("curve_3", "Nm"),
        ("curve_4", "Nm"),
    ],
    price: |_| 30.0,
    may_repeat: true,
    of_rigid: true,
    lengths: &[5],
    forms: |cause, scene| {
        let form = |joint: usize, with: [usize; 2], width: usize| {
            let form = TorqueForm {
                with,
                ..TorqueForm::at_joint(cause, joint, width)
            };
            ranged(form, scene, 5)
        };
        let of_joint = |joint: usize| {
            let others = (0..scene.joints()).filter(move |other| *other != joint);
            let others = others.map(|other| ([ANGLE, other], CURVE));
            let own = [
                ([LOAD, 0], CURVE),
                ([TIME, 0], DRIFT),
                ([TEMPERATURE, 0], DRIFT),
            ];
            let all: Vec<_> = own.into_iter().chain(others).collect();
            all.into_iter()
                .filter_map(move |(with, width)| form(joint, with, width))
        };
        (0..scene.joints()).flat_map(of_joint).collect()
    },
    cell: |form| form.with,
    torque: ColumnTorque::Row(half_wave),
    statement: |form, _, _| {
        let place = form.place;
        match form.with {
            [LOAD, _] => {
                format!(
                    "something without a name acts at {place}; it depends on the load of the joint"
                )
            }
            [ANGLE, other] => format!(
                "something without a name acts at {place}; it depends on the angle of joint {}",
                other + 1
            ),
            [TIME, _] => {
                format!("something without a name acts at {place}; it depends on time")
            }
            _ => format!("something without a name acts at {place}; it depends on the temperature"),
        }
    },
    ..PLAIN
};

/// Friction over the temperature. Shape: the ends of its range, then zeros.
pub(super) static DRY_OVER_TEMPERATURE: TorqueCause = TorqueCause {
    name: UNKNOWN,
    follows: |_| "temperature",
    coefficients: &[("drag_curve_1", "Nm"), ("drag_curve_2", "Nm")],
    price: |_| 30.0,
    may_repeat: true,
    of_sign: true,
    modifies: &[COULOMB],
    lengths: &[6],
    forms: |cause, scene| {
        let form = |joint: usize| {
            let form = TorqueForm {
                with: [TEMPERATURE, 0],
                ..TorqueForm::at_joint(cause, joint, DRIFT)
            };
            ranged(form, scene, 6)
        };
        (0..scene.joints()).filter_map(form).collect()
    },
    torque: ColumnTorque::Row(|column, row| column.direction(row) * half_wave(column, row)),
    statement: |form, _, _| {
        format!(
            "friction without a name acts at {} in addition to Coulomb friction; it depends on the temperature",
            form.place
        )
    },
    ..PLAIN
};

/// A form with the range of its variable, padded with zeros to so many shape values; none where the variable does not change.
fn ranged(form: TorqueForm, scene: &DynamicScene, numbers: usize) -> Option<TorqueForm> {
    let values = (0..scene.rows()).filter_map(|row| over(&form, scene, row));
    let [least, most] = ends(values);
    let enough = match form.with[0] {
        TEMPERATURE => LEAST_WARMTH,
        _ => 0.0,
    };
    let mut shape = vec![0.0; numbers];
    shape[..2].copy_from_slice(&[least, most]);
    (most - least > enough).then(|| form.shaped(&shape))
}

/// The variable in a row.
fn over(form: &TorqueForm, scene: &DynamicScene, row: usize) -> Option<f64> {
    Some(match form.with {
        [LOAD, _] => scene.rigid[form.joint()][row],
        [ANGLE, other] => scene.position[other][row],
        [TIME, _] => scene.time[row],
        _ => *scene.temperature.get(row)?,
    })
}

/// Half waves of the share of the range, one a column.
fn half_wave(column: &ColumnOf, row: usize) -> f64 {
    let [least, most] = [column.form.shape[0], column.form.shape[1]];
    let share = |value: f64| ((value - least) / (most - least)).clamp(0.0, 1.0);
    let wave = |value: f64| (PI * (column.column + 1) as f64 * share(value)).cos();
    over(column.form, column.scene, row).map_or(0.0, wave)
}
