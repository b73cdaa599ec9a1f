//! Torques that remember rows before: what turns over after a travel, knocks after a reversal, swings.

use super::{
    ColumnTorque, PLAIN, ShapeSpan, TorqueCause, TorqueForm, angle::UNKNOWN, at_each_joint,
    friction::COULOMB, plain, shape, span,
};
use crate::recording::largest;
use std::f64::consts::PI;

/// rad: the travel that stands in the rich model, and all that are tried.
const USUAL_TRAVEL: f64 = 0.004;
const TRAVELS: [&[f64]; 5] = [&[0.0006], &[0.0015], &[USUAL_TRAVEL], &[0.01], &[0.025]];
/// Share of the other ones that bristles may drive with.
const DRIVES: f64 = 0.25;
/// The longer travel over the other one.
const LONGER: f64 = 4.0;
/// rad/s below which a joint is at rest.
const REST: f64 = 2e-3;

/// What is kept of a direction after a move: exponential over a travel after each reversal, kept at rest.
fn kept_after(kept: f64, moved: f64, travel: f64) -> f64 {
    match moved == 0.0 {
        true => kept,
        false => moved.signum() + (kept - moved.signum()) * (-moved.abs() / travel).exp(),
    }
}

/// Friction that turns with the direction of motion only after a travel, and is kept at rest: z - sgn v with z' = (v - |v| z) / travel (Dahl,
/// 1968); where bristles differ, the same over a longer travel, too.
pub(super) static PRESLIDING: TorqueCause = TorqueCause {
    name: "presliding_friction",
    follows: |_| "own speed",
    coefficients: &[("kept", "Nm"), ("kept_longer", "Nm")],
    price: |_| 25.0,
    of_sign: true,
    modifies: &[COULOMB],
    positive: true,
    rich: |form| form.width == 1 && form.shape == [USUAL_TRAVEL],
    forms: |cause, scene| {
        [1, 2]
            .into_iter()
            .flat_map(|width| at_each_joint(cause, scene, width, &TRAVELS))
            .collect()
    },
    // Bristles resist, the short ones and the long ones; a little less than nothing is the width over which the sign turns.
    is_possible: |_, values| {
        let most = values.iter().copied().fold(0.0, f64::max);
        values.iter().all(|kept| *kept >= -DRIVES * most)
    },
    spans: |_| vec![span("travel", "rad", [3e-4, 0.05])],
    torque: ColumnTorque::Course(|column, out| {
        let longer = if column.column == 0 { 1.0 } else { LONGER };
        let travel = longer * column.form.shape[0];
        for stretch in &column.scene.stretches {
            let mut kept = 0.0;
            for row in stretch.clone() {
                let velocity = column.velocity(row);
                let is_moving = velocity.abs() > REST;
                let moved = if is_moving {
                    velocity / column.scene.rate
                } else {
                    0.0
                };
                kept = kept_after(kept, moved, travel);
                out[row] = kept - column.direction(row);
            }
        }
    }),
    statement: |form, fitted, unit| {
        let value: f64 = fitted.iter().map(|kept| kept.value).sum();
        format!(
            "friction of {} turns over a travel of {:.2e} {} and is kept at rest, {value:.3} {} of it",
            form.place,
            form.shape[0],
            unit("rad"),
            unit("Nm")
        )
    },
    ..PLAIN
};

/// Travels of drag, least and greatest one of the search, rad.
const DRAG_TRAVELS: [&[f64]; 3] = [&[0.08, 0.05, 1.0], &[0.2, 0.05, 1.0], &[0.5, 0.05, 1.0]];

/// Drag without a name that turns over only after a travel of a good part of a radian: hoses and cable guides that bend with their joint.
pub(super) static HYSTERESIS: TorqueCause = TorqueCause {
    name: UNKNOWN,
    follows: |_| "own angle",
    coefficients: &[("kept", "Nm")],
    price: |_| 30.0,
    positive: true,
    may_repeat: true,
    lengths: &[3],
    forms: |cause, scene| at_each_joint(cause, scene, 1, &DRAG_TRAVELS),
    spans: |form| vec![span("travel", "rad", [form.shape[1], form.shape[2]])],
    torque: ColumnTorque::Course(|column, out| {
        for stretch in &column.scene.stretches {
            let (mut kept, mut before) = (0.0, column.angle(stretch.start));
            for row in stretch.clone() {
                let now = column.angle(row);
                kept = kept_after(kept, now - before, column.form.shape[0]);
                before = now;
                out[row] = kept;
            }
        }
    }),
    statement: |form, _, unit| {
        format!(
            "something without a name drags at {} and turns over only after a travel of {:.3} {}",
            form.place,
            form.shape[0],
            unit("rad")
        )
    },
    ..PLAIN
};

/// s: the time that stands in the rich model, and all that are tried.
const USUAL_TIME: f64 = 0.05;
const TIMES: [&[f64]; 4] = [&[0.03], &[USUAL_TIME], &[0.08], &[0.12]];
/// rad/s below which a direction does not count.
const NO_DIRECTION: f64 = 0.006;
/// Beyond so many times T nothing is left.
const OVER: f64 = 20.0;

/// Lost motion, a knock after each reversal of a joint: (t / T) exp(1 - t / T) with the new direction's sign.
pub(super) static SPIKES: TorqueCause = TorqueCause {
    name: "backlash_spikes",
    follows: |_| "own speed",
    coefficients: &[("height", "Nm")],
    price: |_| 25.0,
    positive: true,
    rich: |form| form.shape == [USUAL_TIME],
    forms: |cause, scene| at_each_joint(cause, scene, 1, &TIMES),
    spans: |_| vec![span("time", "s", [0.01, 0.3])],
    torque: ColumnTorque::Course(|column, out| {
        let (rate, lasting) = (column.scene.rate, column.form.shape[0]);
        let long = (OVER * lasting * rate) as usize + 1;
        for stretch in &column.scene.stretches {
            let mut direction = 0.0;
            for row in stretch.clone() {
                let velocity = column.velocity(row);
                let now = velocity.signum();
                if velocity.abs() <= NO_DIRECTION || now == direction {
                    continue;
                }
                direction = now;
                let end = stretch.end.min(row + long);
                for (step, value) in out[row..end].iter_mut().enumerate() {
                    let share = step as f64 / rate / lasting;
                    *value += now * share * (1.0 - share).exp();
                }
            }
        }
    }),
    statement: |form, fitted, unit| {
        format!(
            "each reversal of {} knocks with {} {}, {:.3} s later: lost motion",
            form.place,
            fitted[0].rounded(),
            unit("Nm"),
            form.shape[0]
        )
    },
    ..PLAIN
};

/// rad, and friction of the link over its greatest load: all that are tried.
const PLAYS: [f64; 4] = [0.002, 0.005, 0.01, 0.02];
const HELD: [f64; 3] = [0.3, 0.8, 2.5];
/// Share of what is not felt, within errors of the load and of the friction.
const UNFELT: [f64; 2] = [0.4, 1.6];

/// Play of a gear: a link that its own friction holds stands while the motor crosses the play after a reversal, and neither its load nor that
/// friction is felt so long. A load above the friction keeps the gear on its flank. Shape: the play, and the friction.
pub(super) static PLAY: TorqueCause = TorqueCause {
    name: "backlash",
    follows: |_| "own speed",
    coefficients: &[("share", "1")],
    price: |_| 25.0,
    of_rigid: true,
    of_sign: true,
    modifies: &[COULOMB],
    positive: true,
    forms: |cause, scene| {
        let of_joint = |joint: usize| {
            let most = largest(&scene.rigid[joint]).max(f64::MIN_POSITIVE);
            let shape = |play: f64| HELD.map(|share| [play, share * most]);
            let shapes: Vec<[f64; 2]> = PLAYS.into_iter().flat_map(shape).collect();
            let form = move |shape: [f64; 2]| TorqueForm::at_joint(cause, joint, 1).shaped(&shape);
            shapes.into_iter().map(form)
        };
        (0..scene.joints()).flat_map(of_joint).collect()
    },
    is_possible: |_, values| (UNFELT[0]..=UNFELT[1]).contains(&values[0]),
    spans: |form| {
        let friction = form.shape[1];
        let held = ShapeSpan {
            index: 1,
            ..span("friction", "Nm", [0.1 * friction, 10.0 * friction])
        };
        vec![span("play", "rad", [1e-3, 0.06]), held]
    },
    torque: ColumnTorque::Course(|column, out| {
        let &[play, friction] = &column.form.shape[..] else {
            return;
        };
        let rigid = &column.scene.rigid[column.form.joint()];
        for stretch in &column.scene.stretches {
            let mut across: f64 = 0.5;
            for row in stretch.clone() {
                let (load, velocity) = (rigid[row], column.velocity(row));
                if load.abs() > friction {
                    across = if load > 0.0 { 1.0 } else { 0.0 };
                    continue;
                }
                let before = across;
                let moved = velocity / column.scene.rate / play;
                across = (across + moved).clamp(0.0, 1.0);
                // Of the row in which the other flank is reached, the part before.
                let share = match moved == 0.0 {
                    true if across == 0.0 || across == 1.0 => 0.0,
                    true => 1.0,
                    false => ((across - before) / moved).abs(),
                };
                out[row] = -share * (load + friction * column.direction(row));
            }
        }
    }),
    parameters: |form, fitted| {
        let unfelt = form.shape[1] * fitted[0].value;
        vec![
            shape("play", form.shape[0], "rad"),
            shape("friction", unfelt, "Nm"),
        ]
    },
    statement: |form, fitted, unit| {
        format!(
            "{} has a play of {:.2e} {}: after each reversal neither its load nor {:.2} {} of friction behind the play is felt until it is crossed",
            form.place,
            form.shape[0],
            unit("rad"),
            form.shape[1] * fitted[0].value,
            unit("Nm")
        )
    },
    ..PLAIN
};

/// The second coefficient over the first, at most: twice the greatest z.
const TRANSMITTED: f64 = 1.2;
/// Least share of the rigid arm's torque that swings: all of it does, and at resonances (Hz) beyond what was filtered only the ratio of the
/// share to the resonance squared is seen.
const SWINGING: f64 = 0.5;
const SEEN: f64 = 15.0;
const HERTZ: [f64; 8] = [3.0, 4.0, 5.0, 6.0, 7.0, 8.5, 10.0, 12.0];
const DAMPING: [f64; 2] = [0.05, 0.15];

/// A joint that swings, its torque that of the rigid arm behind a resonance: G tau - tau with G = w^2 / (s^2 + 2 z w s + w^2), and w s / (s^2 +
/// 2 z w s + w^2) tau; shape: Hz and z. A damper parallel to the spring transmits torque, 2 z of the second column; one that brakes the swinging
/// side against the base does not.
pub(super) static ELASTICITY: TorqueCause = TorqueCause {
    name: "joint_elasticity",
    follows: |_| "acceleration",
    coefficients: &[("share", "1"), ("transmitted_damping", "1")],
    price: |_| 8.0,
    of_rigid: true,
    rich: |form| form.shape == [5.0, 0.05] || form.shape == [8.5, 0.05],
    forms: |cause, scene| {
        let shapes = HERTZ.map(|hertz| DAMPING.map(|damping| [hertz, damping]));
        let shapes: Vec<&[f64]> = shapes.as_flattened().iter().map(|one| &one[..]).collect();
        at_each_joint(cause, scene, 2, &shapes)
    },
    is_possible: |form, values| {
        let least = if form.shape[0] > SEEN { 0.0 } else { SWINGING };
        let transmitted = values.get(1).copied().unwrap_or(0.0);
        values[0] > least && transmitted.abs() <= TRANSMITTED * values[0]
    },
    spans: |_| {
        let hertz = span("resonance", "Hz", [2.0, 20.0]);
        let damping = ShapeSpan {
            index: 1,
            ..span("damping", "1", [0.005, 0.6])
        };
        vec![hertz.clone(), damping, hertz]
    },
    torque: ColumnTorque::Course(|column, out| {
        let (scene, form) = (column.scene, column.form);
        let (torque, rate, damping) = (&scene.rigid[form.joint()], scene.rate, form.shape[1]);
        // Bilinear transform, prewarped at the resonance.
        let w = 2.0 * rate * (PI * form.shape[0] / rate).tan();
        let k = 2.0 * rate;
        let (d1, d0) = (2.0 * damping * w, w * w);
        let d = k * k + d1 * k + d0;
        let (b, rigid) = match column.column {
            0 => ([d0 / d, 2.0 * d0 / d, d0 / d], 1.0),
            _ => ([w * k / d, 0.0, -w * k / d], 0.0),
        };
        let a = [2.0 * (d0 - k * k) / d, (k * k - d1 * k + d0) / d];
        for stretch in &scene.stretches {
            let first = torque[stretch.start];
            let mut state = [0.0; 2];
            for row in stretch.clone() {
                let input = torque[row] - first;
                let output = b[0] * input + state[0];
                state = [
                    b[1] * input - a[0] * output + state[1],
                    b[2] * input - a[1] * output,
                ];
                out[row] = output - rigid * input;
            }
        }
    }),
    parameters: |form, fitted| {
        vec![
            shape("resonance", form.shape[0], "Hz"),
            shape("damping", form.shape[1], "1"),
            plain("share", fitted[0], "1"),
            plain("transmitted_damping", fitted[1], "1"),
        ]
    },
    statement: |form, _, _| {
        format!(
            "{} swings at {:.1} Hz with a damping ratio of {:.2}",
            form.place, form.shape[0], form.shape[1]
        )
    },
    ..PLAIN
};
