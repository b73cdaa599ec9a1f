//! Motors and drives.

use super::{ColumnTorque, PLAIN, TorqueCause, TorqueForm, at_each_joint, span};
use crate::dynamics::scene::largest;

/// Its name.
pub(crate) const ROTOR: &str = "rotor_inertia";
/// Its name.
pub(crate) const TORQUE_CONSTANT: &str = "torque_constant";

/// Inertia of a motor and its gear, as the joint feels it.
pub(super) static ROTOR_INERTIA: TorqueCause = TorqueCause {
    name: ROTOR,
    coefficients: &[("inertia", "kg m2")],
    price: |_| 2.0,
    rich: |_| true,
    inertial: true,
    positive: true,
    torque: ColumnTorque::Row(|column, row| column.scene.acceleration[column.form.joint()][row]),
    statement: |form, fitted| {
        format!(
            "the rotor of {} adds an inertia of {:.4} kg m2 at the joint",
            form.place, fitted[0].value
        )
    },
    ..PLAIN
};

/// Shares of the largest torque.
const HALVES: [f64; 2] = [0.25, 1.0];
const HALF_SPAN: [f64; 2] = [0.1, 4.0];
/// Share of the declared one: more is no error of a drive.
const LARGEST: f64 = 0.6;

/// A current that makes another torque than declared. With a shape (Nm, and the largest torque of the joint) the difference falls with
/// torque, to half at so many Nm: iron saturates, and a table of a drive is right at its rated current.
pub(super) static WRONG_CONSTANT: TorqueCause = TorqueCause {
    name: TORQUE_CONSTANT,
    coefficients: &[("relative", "1")],
    price: |form| if form.shape.is_empty() { 4.0 } else { 10.0 },
    inertial: true,
    of_rigid: true,
    rich: |form| form.shape.is_empty(),
    forms: |cause, scene| {
        // Where masses are identified it is confounded with them.
        if scene.declared.is_none() {
            return Vec::new();
        }
        let mut forms = at_each_joint(cause, scene, 1, &[&[]]);
        for joint in 0..scene.joints() {
            let largest = largest(&scene.rigid[joint]).max(1e-9);
            forms.extend(HALVES.map(|half| {
                TorqueForm::at_joint(cause, joint, 1).shaped(&[half * largest, largest])
            }));
        }
        forms
    },
    spans: |form| {
        let span = |largest: &f64| span("half_at", "Nm", HALF_SPAN.map(|share| share * largest));
        form.shape.get(1).map(span).into_iter().collect()
    },
    is_possible: |_, values| values[0].abs() < LARGEST,
    torque: ColumnTorque::Row(|column, row| {
        let (joint, scene) = (column.form.joint(), column.scene);
        match column.form.shape.first() {
            None => scene.rigid[joint][row],
            // A drive makes the torque of friction too, which so depends on load.
            Some(half) => {
                let torque = scene.rigid[joint][row] + scene.friction[joint][row];
                torque / (1.0 + torque.abs() / half)
            }
        }
    }),
    statement: |form, fitted| {
        let (place, percent) = (form.place, 100.0 * fitted[0].value);
        match form.shape.first() {
            None => format!(
                "torques of {place} read {percent:+.1} % off: its torque constant is not the declared one"
            ),
            Some(half) => format!(
                "small torques of {place} read {percent:+.1} % off, half of that at {half:.3} Nm: its torque constant is not the declared one"
            ),
        }
    },
    ..PLAIN
};
