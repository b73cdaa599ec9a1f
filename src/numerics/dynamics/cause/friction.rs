//! Friction of one joint by its velocity: viscous, Coulomb, and what modifies them.

use super::{ColumnTorque, PLAIN, ShapeSpan, TorqueCause, TorqueForm, at_each_joint, span};

/// Its name.
pub const COULOMB: &str = "coulomb_friction";
/// Its name.
pub(crate) const VISCOUS: &str = "viscous_friction";

/// Friction that grows with the velocity of a joint. Shape: its exponent, 1 but where the data show another: grease that thins with speed.
pub(super) static VISCOUS_FRICTION: TorqueCause = TorqueCause {
    name: VISCOUS,
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
    torque: ColumnTorque::Row(|column, row| power(column.form, column.velocity(row))),
    friction: Some(|form, _, velocity, _| power(form, velocity)),
    statement: |form, fitted| {
        let grows = exponent(form).map_or_else(String::new, |exponent| {
            format!(", which grows with the power {exponent:.2} of speed")
        });
        format!(
            "{} has viscous friction of {:.3} Nm s/rad{grows}",
            form.place, fitted[0].value
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
pub(super) static COULOMB_FRICTION: TorqueCause = TorqueCause {
    name: COULOMB,
    coefficients: &[("coulomb", "Nm")],
    price: |_| 0.0,
    of_sign: true,
    rich: |_| true,
    brakes: true,
    torque: ColumnTorque::Row(|column, row| column.direction(row)),
    friction: Some(|_, _, _, sign| sign),
    statement: |form, fitted| {
        format!(
            "{} has Coulomb friction of {:.3} Nm",
            form.place, fitted[0].value
        )
    },
    ..PLAIN
};

/// Friction that is greater in one direction of motion.
pub(super) static ASYMMETRIC: TorqueCause = TorqueCause {
    name: "asymmetric_friction",
    coefficients: &[("asymmetry", "Nm")],
    of_sign: true,
    rich: |_| true,
    modifies: &[COULOMB],
    torque: ColumnTorque::Row(|column, row| column.direction(row).max(0.0)),
    friction: Some(|_, _, _, sign| sign.max(0.0)),
    statement: |form, fitted| {
        let is_negative = fitted[0].value < 0.0;
        format!(
            "friction of {} is {:.3} Nm greater in its {} direction",
            form.place,
            fitted[0].value.abs(),
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
        vec![speed, exponent, speed]
    },
    torque: ColumnTorque::Row(|column, row| {
        column.direction(row) * falls(column.form, column.velocity(row))
    }),
    friction: Some(|form, _, velocity, sign| sign * falls(form, velocity)),
    statement: |form, fitted| {
        format!(
            "friction of {} is {:.3} Nm greater when it begins to move, which falls over {:.3} rad/s",
            form.place, fitted[0].value, form.shape[0]
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

/// Friction that grows with the torque that a gear transmits.
pub(super) static LOAD: TorqueCause = TorqueCause {
    name: "load_friction",
    coefficients: &[("share", "1")],
    of_sign: true,
    rich: |_| true,
    modifies: &[COULOMB],
    positive: true,
    of_rigid: true,
    torque: ColumnTorque::Row(|column, row| {
        column.direction(row) * column.scene.rigid[column.form.joint()][row].abs()
    }),
    statement: |form, fitted| {
        format!(
            "{} loses {:.1} % of the torque that it transmits to friction",
            form.place,
            100.0 * fitted[0].value
        )
    },
    ..PLAIN
};

/// s in which a gear warms up.
const TIMES: [f64; 9] = [2.0, 4.0, 8.0, 12.0, 18.0, 26.0, 40.0, 120.0, 400.0];
/// Share of the recording: what lasts longer is friction that stays.
const LONGEST: f64 = 0.45;
/// Share of the recording at which the search for it ends: what is best there is not known.
const END: f64 = 0.9;
/// s, the longest that stands in the rich model.
const USUAL_TIME: f64 = 18.0;

/// Friction that falls while the gear warms up: exp(-t / T) times velocity and its sign; shape: T and the end of its search, `with` marks the
/// form that stands in the rich model.
pub(super) static WARMUP: TorqueCause = TorqueCause {
    name: "warmup_friction",
    coefficients: &[("viscous_cold", "Nm s/rad"), ("coulomb_cold", "Nm")],
    of_sign: true,
    modifies: &[VISCOUS, COULOMB],
    rich: |form| form.with[0] == 1,
    forms: |cause, scene| {
        let longest = LONGEST * scene.duration();
        let times: Vec<f64> = TIMES.into_iter().filter(|time| *time <= longest).collect();
        let may_be_rich = |time: &&f64| **time <= USUAL_TIME.max(longest / 3.0);
        let rich = times.iter().rfind(may_be_rich).copied();
        let shapes: Vec<[f64; 2]> = times
            .iter()
            .map(|time| [*time, END * scene.duration()])
            .collect();
        let shapes: Vec<&[f64]> = shapes.iter().map(|shape| &shape[..]).collect();
        let mut forms = at_each_joint(cause, scene, 2, &shapes);
        for form in &mut forms {
            form.with[0] = usize::from(Some(form.shape[0]) == rich);
        }
        forms
    },
    spans: |form| vec![span("time", "s", [1.0, form.shape[1]])],
    torque: ColumnTorque::Row(|column, row| {
        let decay = (-column.scene.time[row] / column.form.shape[0]).exp();
        decay
            * match column.column {
                0 => column.velocity(row),
                _ => column.direction(row),
            }
    }),
    statement: |form, fitted| {
        format!(
            "friction of {} begins {:.3} Nm and {:.3} Nm s/rad higher and falls over {:.1} s",
            form.place, fitted[1].value, fitted[0].value, form.shape[0]
        )
    },
    ..PLAIN
};
