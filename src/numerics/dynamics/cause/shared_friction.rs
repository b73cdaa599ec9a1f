//! Gears of a wrist that turn with two joints: friction of the sum of two velocities, felt by both.

use super::{ColumnTorque, PLAIN, ShapeSpan, TorqueCause, TorqueForm, plain, shape, span};

/// k of neighbouring joints of a wrist; of other pairs only gears of one to one are tried.
const RATIOS: [f64; 14] = [
    -1.4, -1.2, -1.0, -0.8, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4,
];
const PLAIN_RATIOS: [f64; 2] = [-1.0, 1.0];
/// Ratios that stand in the rich model.
const USUAL: [f64; 2] = [-0.6, 1.0];
const LEAST_RATIO: f64 = 0.15;
/// Joints of a wrist begin here, from 0.
const WRIST: usize = 3;

/// x = v + k v_by, and its sign, at the joint and k times that at the other; `with` holds the other joint, and whether both are known or
/// likely to share a gear.
pub(super) static WRIST_COUPLING: TorqueCause = TorqueCause {
    name: "wrist_coupling",
    coefficients: &[("viscous", "Nm s/rad"), ("coulomb", "Nm")],
    price: |form| if form.with[1] == 1 { 6.0 } else { 30.0 },
    of_sign: true,
    positive: true,
    forms: |cause, scene| {
        let mut forms = Vec::new();
        for moved in 1..scene.joints() {
            for by in (0..scene.joints()).filter(|by| *by != moved) {
                let known = scene.arm.coupled.contains(&(moved, by));
                let near = known || (by + 1 == moved && by >= WRIST && scene.joints() == 6);
                if !near && by > moved {
                    continue;
                }
                let ratios = if near { &RATIOS[..] } else { &PLAIN_RATIOS[..] };
                forms.extend(ratios.iter().map(|ratio| TorqueForm {
                    with: [by, usize::from(near)],
                    ..TorqueForm::at_joint(cause, moved, 2).shaped(&[*ratio])
                }));
            }
        }
        forms
    },
    and_on: |form| Some(form.with[0]),
    // Gears that hardly turn with the other joint do not turn with it.
    is_itself: |form, _| form.shape[0].abs() > LEAST_RATIO,
    // Friction brakes: neither of its numbers drives.
    is_possible: |_, values| values.iter().all(|value| *value >= 0.0),
    rich: |form| form.with[1] == 1 && USUAL.contains(&form.shape[0]),
    spans: |form| {
        let ends = if form.shape[0] > 0.0 {
            [0.05, 2.0]
        } else {
            [-2.0, -0.05]
        };
        vec![ShapeSpan {
            by_ratio: false,
            ..span("ratio", "1", ends)
        }]
    },
    cell: |form| form.with,
    torque: ColumnTorque::Row(|column, row| {
        let (form, velocity) = (column.form, &column.scene.velocity);
        let ratio = form.shape[0];
        let together = velocity[form.joint()][row] + ratio * velocity[form.with[0]][row];
        let share = if column.joint == form.joint() {
            1.0
        } else {
            ratio
        };
        share
            * match column.column {
                0 => together,
                _ => column.scene.sign(together),
            }
    }),
    parameters: |form, fitted| {
        vec![
            plain("viscous", fitted[0], "Nm s/rad"),
            plain("coulomb", fitted[1], "Nm"),
            shape("by_joint", (form.with[0] + 1) as f64, "1"),
            shape("ratio", form.shape[0], "1"),
        ]
    },
    statement: |form, fitted| {
        format!(
            "gears of {} turn with joint {} too (ratio {:.2}): friction of both together is {:.3} Nm and {:.3} Nm s/rad",
            form.place,
            form.with[0] + 1,
            form.shape[0],
            fitted[1].value,
            fitted[0].value
        )
    },
    ..PLAIN
};
