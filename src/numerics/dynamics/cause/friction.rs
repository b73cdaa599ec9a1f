//! Friction of one joint by its velocity: viscous, Coulomb, and what modifies them.

use super::angle::{UNKNOWN, ends};
use super::{
    ColumnTorque, FittedNumber, LASTING, PLAIN, ShapeSpan, TorqueCause, TorqueForm, at_each_joint,
    at_joints, plain, scaled, shape, span, warming, wave,
};
use crate::recording::largest;
use crate::scene::DynamicScene;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::PI;

/// Its name.
pub const COULOMB: &str = "coulomb_friction";
/// Its name.
pub(crate) const VISCOUS: &str = "viscous_friction";

/// Its name.
pub(crate) const LOAD_FRICTION: &str = "load_friction";

/// Friction that grows with the velocity of a joint. Shape: its exponent, 1 but where the data show another: grease that thins with speed.
pub(crate) static VISCOUS_FRICTION: TorqueCause = TorqueCause {
    name: VISCOUS,
    follows: |_| "own speed",
    coefficients: &[("viscous", "Nm s/rad")],
    price: |_| 0.0,
    rich: |_| true,
    brakes: true,
    forms: |cause, scene| at_each_joint(cause, scene, 1, &[&[1.0]]),
    spans: |form| {
        let span = ShapeSpan {
            usual: Some(1.0),
            ..span("exponent", "1", [0.4, 1.6])
        };
        form.shape.first().map(|_| span).into_iter().collect()
    },
    torque: ColumnTorque::Friction(|form, _, velocity, _| power(form, velocity)),
    statement: |form, fitted, unit| {
        let grows = exponent(form).map_or_else(String::new, |exponent| {
            format!(", which grows with the power {exponent:.2} of speed")
        });
        format!(
            "{} has viscous friction of {} {}{grows}",
            form.place,
            fitted[0].rounded(),
            unit("Nm s/rad")
        )
    },
    ..PLAIN
};

/// The straight line nearest to a power of speed over all speeds up to the fastest: at rest, and its slope. Viscous and Coulomb friction that
/// grow with another power are parts of one sum, and as numbers are those of its line.
pub(in super::super) fn line_of_power(exponent: f64, fastest: f64) -> [f64; 2] {
    // Over shares x of the fastest speed: means of x^e and of x x^e.
    let (mean, moment) = (1.0 / (exponent + 1.0), 1.0 / (exponent + 2.0));
    let slope = 12.0 * (moment - 0.5 * mean);
    let scale = fastest.powf(exponent);
    [
        scale * (mean - 0.5 * slope),
        scale * slope / fastest.max(f64::MIN_POSITIVE),
    ]
}

/// Where it is not 1.
fn exponent(form: &TorqueForm) -> Option<f64> {
    form.shape
        .first()
        .copied()
        .filter(|exponent| *exponent != 1.0)
}

/// The power of a velocity, with its sign.
fn power(form: &TorqueForm, velocity: f64) -> f64 {
    exponent(form).map_or(velocity, |exponent| {
        velocity.signum() * velocity.abs().powf(exponent)
    })
}

/// Friction of one size against the direction of motion.
pub(crate) static COULOMB_FRICTION: TorqueCause = TorqueCause {
    name: COULOMB,
    follows: |_| "own speed",
    coefficients: &[("coulomb", "Nm")],
    price: |_| 0.0,
    of_sign: true,
    rich: |_| true,
    brakes: true,
    torque: ColumnTorque::Friction(|_, _, _, sign| sign),
    statement: |form, fitted, unit| {
        format!(
            "{} has Coulomb friction of {} {}",
            form.place,
            fitted[0].rounded(),
            unit("Nm")
        )
    },
    ..PLAIN
};

/// Friction that is greater in one direction of motion.
pub(super) static ASYMMETRIC: TorqueCause = TorqueCause {
    name: "asymmetric_friction",
    follows: |_| "own speed",
    coefficients: &[("asymmetry", "Nm")],
    of_sign: true,
    rich: |_| true,
    modifies: &[COULOMB],
    torque: ColumnTorque::Friction(|_, _, _, sign| sign.max(0.0)),
    statement: |form, fitted, unit| {
        let is_negative = fitted[0].value < 0.0;
        format!(
            "friction of {} is {} {} greater in its {} direction",
            form.place,
            fitted[0].size().rounded(),
            unit("Nm"),
            if is_negative { "negative" } else { "positive" }
        )
    },
    ..PLAIN
};

/// rad/s: the speed that stands in the rich model.
const USUAL_SPEED: f64 = 0.1;
/// Speeds over which friction falls, and exponents, that are tried.
const SPEEDS: [&[f64]; 8] = [
    &[0.05, 1.0],
    &[0.07, 1.0],
    &[USUAL_SPEED, 1.0],
    &[0.15, 1.0],
    &[0.25, 1.0],
    &[0.06, 2.0],
    &[USUAL_SPEED, 2.0],
    &[0.17, 2.0],
];
/// Widths of the sign.
const NARROWEST: f64 = 2.0;

/// Friction that is greater at low speed and falls as the joint gets faster: sgn v exp(-(|v| / vs)^e), e 1 as a rule, 0.5 to 2 reported
/// (Armstrong-Helouvry, 1991, 1994).
pub(super) static STRIBECK: TorqueCause = TorqueCause {
    name: "stribeck_friction",
    follows: |_| "own speed",
    coefficients: &[("stribeck", "Nm")],
    price: |form| match form.shape.get(1) {
        Some(exponent) if *exponent != 1.0 => 10.0,
        _ => 6.0,
    },
    of_sign: true,
    modifies: &[COULOMB],
    positive: true,
    bends: true,
    rich: |form| form.shape == [USUAL_SPEED, 1.0],
    forms: |cause, scene| at_each_joint(cause, scene, 1, &SPEEDS),
    // What falls within the width over which the sign turns is a sign of another width.
    is_itself: |form, scene| form.shape[0] > NARROWEST * scene.width_at(form.joint()),
    spans: |_| {
        let speed = span("speed", "rad/s", [0.02, 0.5]);
        let exponent = ShapeSpan {
            index: 1,
            usual: Some(1.0),
            ..span("exponent", "1", [0.4, 2.5])
        };
        vec![speed.clone(), exponent, speed]
    },
    torque: ColumnTorque::Friction(|form, _, velocity, sign| sign * falls(form, velocity)),
    statement: |form, fitted, unit| {
        format!(
            "friction of {} is {} {} greater when it begins to move, which falls over {:.3} {}",
            form.place,
            fitted[0].rounded(),
            unit("Nm"),
            form.shape[0],
            unit("rad/s")
        )
    },
    ..PLAIN
};

/// The share that is left at a velocity of what it is when the joint begins to move.
fn falls(form: &TorqueForm, velocity: f64) -> f64 {
    let speeds = velocity.abs() / form.shape[0];
    match form.shape.get(1) {
        Some(exponent) if *exponent != 1.0 => (-speeds.powf(*exponent)).exp(),
        _ => (-speeds).exp(),
    }
}

/// Powers of the load that stand in the table of causes.
const LINEAR: f64 = 1.0;
const SQUARE: f64 = 2.0;
/// One share whichever way power goes; one where the motor drives its load and one where the load drives the motor.
const LOAD_WIDTHS: [usize; 2] = [1, 2];
/// Numbers of its shape.
const LOAD_SHAPE: usize = 2;

/// Friction that grows with the torque that a gear transmits; a gear without preload has no other of one size. A gear that drives its load may
/// lose another share of it than one that its load drives. Shape: the power of the load that friction grows with, and the greatest load, Nm,
/// of which shares are; tables of linear friction alone have none.
pub(super) static LOAD: TorqueCause = TorqueCause {
    name: LOAD_FRICTION,
    follows: |_| "load",
    coefficients: &[("share", "1"), ("share_driven_back", "1")],
    of_sign: true,
    rich: |form| form.width == 1 && power_of_load(form) == LINEAR,
    modifies: &[VISCOUS],
    positive: true,
    of_rigid: true,
    lengths: &[0, LOAD_SHAPE],
    forms: |cause, scene| {
        let shape = |power: f64| move |joint: usize| [power, greatest_load(scene, joint)];
        // Identified masses are as much heavier as a joint that moves loses more where it drives.
        let is_known = scene.declared.is_some() || scene.beyond.is_some();
        let widths = &LOAD_WIDTHS[..if is_known { 2 } else { 1 }];
        let linear = at_joints(cause, 0..scene.joints(), widths, shape(LINEAR));
        let square = at_joints(cause, 0..scene.joints(), &LOAD_WIDTHS[..1], shape(SQUARE));
        linear.into_iter().chain(square).collect()
    },
    is_possible: |_, values| values.iter().all(|value| *value >= 0.0),
    spans: |form| {
        let span = ShapeSpan {
            usual: Some(LINEAR),
            ..span("exponent", "1", [0.4, 2.6])
        };
        let has_power = form.width == 1 && !form.shape.is_empty();
        has_power.then_some(span).into_iter().collect()
    },
    torque: ColumnTorque::Row(|column, row| {
        let load = column.scene.rigid[column.form.joint()][row];
        let direction = column.direction(row);
        // At a turn of its direction a gear is driven back as much as it drives.
        let drives = 0.5 * (1.0 + load.signum() * direction);
        let part = match (column.form.width, column.column) {
            (1, _) => 1.0,
            (_, 0) => drives,
            _ => 1.0 - drives,
        };
        part * direction * transmitted(column.form, load)
    }),
    parameters: |form, fitted| {
        let shares = form.cause.coefficients.iter().zip(fitted);
        let shares = shares.map(|((name, unit), share)| plain(name, *share, unit));
        let exponent = power_of_load(form);
        let is_other = exponent != LINEAR;
        let exponent = is_other.then(|| shape("exponent", exponent, "1"));
        let load = is_other.then(|| shape("at_load", form.shape[1], "Nm"));
        shares.chain(exponent).chain(load).collect()
    },
    statement: |form, fitted, unit| {
        let (place, exponent) = (form.place, power_of_load(form));
        let percent = |share: &FittedNumber| format!("{} %", scaled(share, 100.0).rounded());
        let transmitted = match exponent == LINEAR {
            true => "of the torque that it transmits".to_string(),
            false => format!(
                "of its greatest load of {:.2} {}",
                form.shape[1],
                unit("Nm")
            ),
        };
        let grows = match exponent == LINEAR {
            true => String::new(),
            false => format!(", and less by the power {exponent:.2} of a lower one"),
        };
        match fitted {
            [driving, back] => format!(
                "{place} loses {} {transmitted} to friction where it drives and {} where its load drives it{grows}",
                percent(driving),
                percent(back)
            ),
            _ => format!(
                "{place} loses {} {transmitted} to friction{grows}",
                percent(&fitted[0])
            ),
        }
    },
    ..PLAIN
};

/// The power of the load that its friction grows with.
fn power_of_load(form: &TorqueForm) -> f64 {
    form.shape.first().copied().unwrap_or(LINEAR)
}

/// Takes shares of load friction from the greatest load as it is believed now.
pub(in super::super) fn of_greatest_load(form: &mut TorqueForm, scene: &DynamicScene) {
    if form.cause.name == LOAD.name && form.shape.len() == LOAD_SHAPE {
        form.shape[1] = greatest_load(scene, form.joint());
    }
}

/// Nm, of the rigid arm as it is believed; 1 where no masses are.
fn greatest_load(scene: &DynamicScene, joint: usize) -> f64 {
    match largest(&scene.rigid[joint]) {
        load if load > 0.0 => load,
        _ => 1.0,
    }
}

/// Nm, of a load, to the power that its friction grows with.
fn transmitted(form: &TorqueForm, load: f64) -> f64 {
    match form.shape[..] {
        [power, most] if power != LINEAR => most * (load.abs() / most).powf(power),
        _ => load.abs(),
    }
}

/// s in which a gear warms up.
const TIMES: [f64; 9] = [2.0, 4.0, 8.0, 12.0, 18.0, 26.0, 40.0, 120.0, 400.0];
/// s, the longest that stands in the rich model.
const USUAL_TIME: f64 = 18.0;

/// Friction that falls while the gear warms up: exp(-t / T) times velocity and its sign; shape: T and the end of its search, `with` marks the
/// form that stands in the rich model.
pub(super) static WARMUP: TorqueCause = TorqueCause {
    name: "warmup_friction",
    follows: |_| "time",
    coefficients: &[("viscous_cold", "Nm s/rad"), ("coulomb_cold", "Nm")],
    of_sign: true,
    modifies: &[VISCOUS, COULOMB],
    rich: |form| form.with[0] == 1,
    forms: |cause, scene| {
        let mut forms = warming(cause, scene, &TIMES);
        let most = USUAL_TIME.max(LASTING * scene.duration() / 3.0);
        let times = forms.iter().map(|form| form.shape[0]);
        let rich = times.filter(|time| *time <= most).fold(0.0, f64::max);
        for form in &mut forms {
            form.with[0] = usize::from(form.shape[0] == rich);
        }
        forms
    },
    spans: |form| vec![span("time", "s", [1.0, form.shape[1]])],
    torque: ColumnTorque::Row(|column, row| {
        let decay = (-column.scene.time[row] / column.form.shape[0]).exp();
        let value = match column.column {
            0 => column.velocity(row),
            _ => column.direction(row),
        };
        decay * value
    }),
    statement: |form, fitted, unit| {
        format!(
            "friction of {} begins {} {} and {} {} higher and falls over {:.1} s",
            form.place,
            fitted[1].rounded(),
            unit("Nm"),
            fitted[0].rounded(),
            unit("Nm s/rad"),
            form.shape[0]
        )
    },
    ..PLAIN
};

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
    follows: |_| "own speed",
    of_turn: true,
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
        let share = match column.joint == form.joint() {
            true => 1.0,
            false => ratio,
        };
        let value = match column.column {
            0 => together,
            _ => column.scene.sign(together),
        };
        share * value
    }),
    parameters: |form, fitted| {
        vec![
            plain("viscous", fitted[0], "Nm s/rad"),
            plain("coulomb", fitted[1], "Nm"),
            shape("by_joint", (form.with[0] + 1) as f64, "1"),
            shape("ratio", form.shape[0], "1"),
        ]
    },
    statement: |form, fitted, _| {
        format!(
            "gears of {} turn with joint {} too (ratio {:.2}): friction of both together is {} Nm and {} Nm s/rad",
            form.place,
            form.with[0] + 1,
            form.shape[0],
            fitted[1].rounded(),
            fitted[0].rounded()
        )
    },
    ..PLAIN
};

/// Columns.
const WAVES: usize = 4;
/// Share of the fastest speed below which a joint hardly moves.
const STILL: f64 = 0.02;

/// A smooth curve of speed, of which viscous and Coulomb friction are the straight line: half a wave and a whole one of speed, up to the fastest
/// (shape, rad/s), with the sign of the velocity, each without the straight line of speed that is nearest to it over the recorded rows (two
/// further numbers each): that line is viscous and Coulomb friction, which so are those of the whole curve.
pub(super) static BY_SPEED: TorqueCause = TorqueCause {
    name: UNKNOWN,
    follows: |_| "own speed",
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
        at_joints(cause, 0..scene.joints(), &[WAVES], |joint| {
            let fastest = largest(&scene.velocity[joint]).max(1e-6);
            let speeds = scene.velocity[joint].iter().map(|v| v.abs() / fastest);
            let speeds: Vec<f64> = speeds.filter(|speed| *speed > STILL).collect();
            let lines = (0..WAVES).flat_map(|column| line(&speeds, column));
            std::iter::once(fastest).chain(lines).collect::<Vec<f64>>()
        })
    },
    torque: ColumnTorque::Friction(|form, column, velocity, sign| {
        sign * bent(form, column, velocity)
    }),
    statement: |form, _, _| {
        format!(
            "friction without a name acts at {}: a curve of how fast the joint moves, of which viscous and Coulomb friction are the straight line",
            form.place
        )
    },
    ..PLAIN
};

/// A wave of a speed, as a share of the fastest: sine and cosine of half a wave, then of a whole one.
fn speed_wave(column: usize, speed: f64) -> f64 {
    wave(1 + column, PI * [1.0, 2.0][column / 2] * speed)
}

/// A wave at a velocity without its line. Faster than any row it stays what it was at the fastest.
fn bent(form: &TorqueForm, column: usize, velocity: f64) -> f64 {
    let speed = (velocity.abs() / form.shape[0]).min(1.0);
    let line = form
        .shape
        .get(1 + 2 * column..3 + 2 * column)
        .map_or(0.0, |line| line[0] + line[1] * speed);
    speed_wave(column, speed) - line
}

/// The line of speed nearest to a wave over some speeds: at none, and per share of the fastest.
fn line(speeds: &[f64], column: usize) -> [f64; 2] {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for speed in speeds {
        let row = Vector2::new(1.0, *speed);
        normal += row * row.transpose();
        right += row * speed_wave(column, *speed);
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
    follows: |_| "own angle",
    of_turn: true,
    coefficients: &[("drag_cosine", "Nm"), ("drag_sine", "Nm")],
    price: |_| 30.0,
    of_sign: true,
    modifies: &[COULOMB],
    may_repeat: true,
    lengths: &[2],
    forms: |cause, scene| {
        let of_joint = |joint: usize| {
            let ends = ends(scene, joint);
            (1..=ORDERS).map(move |order| TorqueForm {
                with: [order, 0],
                ..TorqueForm::at_joint(cause, joint, 2).shaped(&ends)
            })
        };
        (0..scene.joints()).flat_map(of_joint).collect()
    },
    torque: ColumnTorque::Row(|column, row| {
        let turn = column.form.with[0] as f64 * column.angle(row);
        column.direction(row) * wave(column.column, turn)
    }),
    parameters: |form, fitted| {
        vec![
            plain("drag_cosine", fitted[0], "Nm"),
            plain("drag_sine", fitted[1], "Nm"),
            shape("order", form.with[0] as f64, "1"),
        ]
    },
    statement: |form, _, _| {
        format!(
            "friction without a name acts at {} in addition to Coulomb friction; it depends on the angle of the joint",
            form.place
        )
    },
    ..PLAIN
};
