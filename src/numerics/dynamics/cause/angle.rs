//! Torques over the angle of a joint: constants, springs, waves, and curves without a name.

use super::{
    ColumnTorque, PLAIN, TorqueCause, TorqueForm, at_each_joint, at_joints, plain, shape,
    size_of_two, span, warming, wave,
};
use crate::criteria::cells::MARGIN;
use crate::recording;
use crate::scene::DynamicScene;
use std::f64::consts::PI;

/// Its name.
pub(crate) const OFFSET: &str = "current_offset";
/// What has no name.
pub(crate) const UNKNOWN: &str = "unknown";
/// Its name.
const SPRING_BALANCE_NAME: &str = "spring_balance";

/// Least and greatest angle of a joint, rad.
pub(super) fn ends(scene: &DynamicScene, joint: usize) -> [f64; 2] {
    recording::ends(scene.position[joint].iter().copied())
}

/// s in which a sensor warms up.
const TIMES: [f64; 3] = [5.0, USUAL_TIME, 45.0];
/// s, of the form that stands in the rich model.
const USUAL_TIME: f64 = 15.0;

/// A constant torque that no mass explains: the zero of a current or torque sensor. With a shape (s, and the end of its search) a part of it
/// comes only as the sensor warms up.
pub(crate) static CURRENT_OFFSET: TorqueCause = TorqueCause {
    name: OFFSET,
    follows: |_| "constant",
    coefficients: &[("offset", "Nm"), ("cold", "Nm")],
    price: |form| if form.width == 1 { 0.0 } else { 4.0 },
    rich: |form| form.width == 1 || form.shape[0] == USUAL_TIME,
    forms: |cause, scene| {
        let mut forms = at_each_joint(cause, scene, 1, &[&[]]);
        forms.extend(warming(cause, scene, &TIMES));
        forms
    },
    spans: |form| {
        let span = |most: &f64| span("time", "s", [2.0, *most]);
        form.shape.get(1).map(span).into_iter().collect()
    },
    torque: ColumnTorque::Row(|column, row| match column.column {
        0 => 1.0,
        _ => (-column.scene.time[row] / column.form.shape[0]).exp(),
    }),
    statement: |form, fitted, unit| {
        let is_little = fitted[0].value < 0.0;
        let newtons = unit("Nm");
        let constant = format!(
            "the torque of {} reads {} {newtons} too {}, whatever it does",
            form.place,
            fitted[0].size().rounded(),
            if is_little { "little" } else { "much" }
        );
        match fitted.get(1) {
            None => constant,
            Some(cold) => format!(
                "{constant}; it begins {} {newtons} from that and comes there over {:.1} s",
                cold.rounded(),
                form.shape[0]
            ),
        }
    },
    ..PLAIN
};

/// Angles at which a curve is looked at.
const CHECKED: usize = 8;
/// Columns of a spring: straight, and one that stiffens as it bends.
const SPRINGS: [usize; 2] = [2, 4];
/// The joint that arms balance, from 0.
const BALANCED: usize = 1;

/// It, where the arm has it.
fn balanced(scene: &DynamicScene) -> impl Iterator<Item = usize> {
    (0..scene.joints()).filter(|joint| *joint == BALANCED)
}

/// At a joint that no balancer hangs at.
pub(super) static CABLE_STIFFNESS: TorqueCause = SPRING;

/// Torque that grows with the angle of a joint, a cable or hose: q and 1; of what stiffens as it bends its square and cube, too. Shape: least
/// and greatest angle, rad.
const SPRING: TorqueCause = TorqueCause {
    name: "cable_stiffness",
    follows: |_| "own angle",
    coefficients: &[
        ("stiffness", "Nm/rad"),
        ("at_zero", "Nm"),
        ("square", "Nm/rad2"),
        ("cube", "Nm/rad3"),
    ],
    rich: |form| form.width == SPRINGS[0],
    lengths: &[2],
    forms: |cause, scene| {
        let joints = (0..scene.joints()).filter(|joint| *joint != BALANCED);
        at_joints(cause, joints, &SPRINGS, |joint| ends(scene, joint))
    },
    torque: ColumnTorque::Row(|column, row| match column.column {
        0 => column.angle(row),
        1 => 1.0,
        power => column.angle(row).powi(power as i32),
    }),
    // What bends resists: its stiffness is positive wherever the joint moves.
    is_possible: |form, values| {
        let number = |power: usize| values.get(power).copied().unwrap_or(0.0);
        let stiffness = |q: f64| number(0) + 2.0 * number(2) * q + 3.0 * number(3) * q * q;
        let &[least, most, ..] = &form.shape[..] else {
            return true;
        };
        (0..=CHECKED).all(|k| stiffness(least + (most - least) * k as f64 / CHECKED as f64) > 0.0)
    },
    statement: |form, fitted, unit| {
        let is_cable = form.cause.name != SPRING_BALANCE_NAME;
        format!(
            "{} acts on {} with {} {} and {} {} at zero",
            if is_cable {
                "a cable or hose"
            } else {
                "a balancing spring"
            },
            form.place,
            fitted[0].rounded(),
            unit("Nm/rad"),
            fitted[1].rounded(),
            unit("Nm")
        )
    },
    ..PLAIN
};

/// The same at the joint that arms balance, a spring. Shape: none of a straight one, which may work over its dead centre; else the highest
/// power, too.
pub(super) static SPRING_BALANCE: TorqueCause = TorqueCause {
    name: SPRING_BALANCE_NAME,
    lengths: &[0, 3],
    forms: |cause, scene| {
        let joints = || balanced(scene);
        let [straight, stiffens] = SPRINGS;
        let bent = |joint| {
            let [least, most] = ends(scene, joint);
            [least, most, (stiffens - 1) as f64]
        };
        let mut forms = at_joints(cause, joints(), &[straight], |_| [0.0; 0]);
        forms.extend(at_joints(cause, joints(), &[stiffens], bent));
        forms
    },
    ..SPRING
};

/// Columns of a balancer without a second wave, with it, and with the constant.
const BALANCERS: [usize; 3] = [2, 4, 5];
/// Rms of the torque where the joint moves over that of the first wave, at least.
const LEAST_WHOLE: f64 = 0.4;

/// The waves of an angle, column by column.
fn waves(q: f64) -> [f64; 5] {
    [q.cos(), q.sin(), (2.0 * q).cos(), (2.0 * q).sin(), 1.0]
}

/// A balancer at the joint that arms balance: its torque swings with the joint's angle. Between two points a spring's lever is a sine of the
/// angle: one wave a turn; where its force grows with its stroke (gas, a bent lever) a second wave and a constant. A ripple of one wave a turn
/// is the same torque: there it is a balancer, with the ripple as its rival. Shape: least and greatest angle of the joint, rad.
pub(super) static BALANCER: TorqueCause = TorqueCause {
    name: SPRING_BALANCE_NAME,
    follows: |_| "own angle",
    of_turn: true,
    coefficients: &[
        ("cosine", "Nm"),
        ("sine", "Nm"),
        ("second_cosine", "Nm"),
        ("second_sine", "Nm"),
        ("constant", "Nm"),
    ],
    price: |_| 4.0,
    lengths: &[2],
    forms: |cause, scene| {
        at_joints(cause, balanced(scene), &BALANCERS, |joint| {
            ends(scene, joint)
        })
    },
    torque: ColumnTorque::Row(|column, row| waves(column.angle(row))[column.column]),
    // The second wave only bends the first: the remainder of two that cancel each other where the joint moves is another torque.
    is_possible: |form, values| {
        let &[least, most] = &form.shape[..] else {
            return true;
        };
        let angles = || (0..=CHECKED).map(|k| least + (most - least) * k as f64 / CHECKED as f64);
        let square = |count: usize| {
            let torque = |q: f64| {
                let terms = waves(q).into_iter().zip(&values[..count]);
                terms.map(|(wave, value)| wave * value).sum::<f64>()
            };
            angles().map(|q| torque(q).powi(2)).sum::<f64>()
        };
        square(values.len()) >= LEAST_WHOLE * LEAST_WHOLE * square(values.len().min(BALANCERS[0]))
    },
    statement: |form, fitted, _| {
        let size = size_of_two(fitted).rounded();
        // -size sin(q - zero).
        let zero = fitted[0].value.atan2(-fitted[1].value).to_degrees();
        format!(
            "a balancing spring acts on {} with up to {size} Nm; it pulls towards {zero:.0} deg",
            form.place
        )
    },
    ..PLAIN
};

/// Orders per turn of the joint, and of the motor; the last of each only shows that the order is beyond.
const ORDERS: usize = 9;
const MOTOR_ORDERS: usize = 3;
/// Lowest orders stand in the rich model.
const USUAL_ORDER: usize = 4;
/// The highest order that is tried with an overtone.
const WITH_OVERTONE: usize = 4;

/// Torque that comes back with every turn, or part of a turn, of a joint or its motor: cosine and sine of an order, and of a ripple that is no
/// plain wave those of twice the order; `with` holds the order and whether it is of the motor. Shape: turns of the motor in one of the joint.
pub(super) static RIPPLE: TorqueCause = TorqueCause {
    name: "torque_ripple",
    follows: |_| "own angle",
    of_turn: true,
    coefficients: &[
        ("cosine", "Nm"),
        ("sine", "Nm"),
        ("overtone_cosine", "Nm"),
        ("overtone_sine", "Nm"),
    ],
    may_repeat: true,
    rich: |form| form.width == 2 && form.with[1] == 0 && form.with[0] <= USUAL_ORDER,
    forms: |cause, scene| {
        let mut forms = Vec::new();
        for joint in 0..scene.joints() {
            let ratio = scene.arm.ratio[joint].abs();
            let mut add = |order: usize, motor: usize, width: usize| {
                forms.push(TorqueForm {
                    with: [order, motor],
                    ..TorqueForm::at_joint(cause, joint, width).shaped(&[ratio])
                });
            };
            (1..=ORDERS).for_each(|order| add(order, 0, 2));
            (1..=WITH_OVERTONE).for_each(|order| add(order, 0, 4));
            if ratio > ORDERS as f64 {
                (1..=MOTOR_ORDERS).for_each(|order| add(order, 1, 2));
            }
        }
        forms
    },
    has_ends: |form| form.with[0] >= [ORDERS, MOTOR_ORDERS][form.with[1].min(1)],
    torque: ColumnTorque::Row(|column, row| {
        let [order, motor] = column.form.with;
        let turns = match motor {
            1 => column.form.shape[0],
            _ => 1.0,
        };
        let periods = order as f64 * turns * (1 + column.column / 2) as f64;
        wave(column.column, periods * column.angle(row))
    }),
    parameters: |form, fitted| {
        let [order, motor] = form.with;
        vec![
            plain("amplitude", size_of_two(fitted), "Nm"),
            shape("phase", fitted[1].value.atan2(fitted[0].value), "rad"),
            shape(["order", "motor_order"][motor.min(1)], order as f64, "1"),
        ]
    },
    statement: |form, fitted, _| {
        let [order, motor] = form.with;
        format!(
            "the torque of {} ripples by {} Nm, {order} times a turn of {}",
            form.place,
            size_of_two(fitted).rounded(),
            ["the joint", "its motor"][motor.min(1)]
        )
    },
    ..PLAIN
};

/// Columns of a slow curve and of one with more detail.
const CURVES: [usize; 2] = [5, 9];

/// One smooth curve of a joint's own angle, whatever its shape: a constant and half waves of the angle, counted over a range that is wider than
/// the recorded one, as cosines have no slope at its ends. Shape: the ends of that range and of the recorded one, rad.
pub(super) static ONE_ANGLE: TorqueCause = TorqueCause {
    name: UNKNOWN,
    follows: |_| "own angle",
    coefficients: &[
        ("mean", "Nm"),
        ("half_waves_1", "Nm"),
        ("half_waves_2", "Nm"),
        ("half_waves_3", "Nm"),
        ("half_waves_4", "Nm"),
        ("half_waves_5", "Nm"),
        ("half_waves_6", "Nm"),
        ("half_waves_7", "Nm"),
        ("half_waves_8", "Nm"),
    ],
    price: |_| 10.0,
    may_repeat: true,
    lengths: &[4],
    forms: |cause, scene| {
        at_joints(cause, 0..scene.joints(), &CURVES, |joint| {
            let [least, most] = ends(scene, joint);
            let margin = *MARGIN * (most - least);
            [least - margin, most + margin, least, most]
        })
    },
    torque: ColumnTorque::Row(|column, row| {
        let (from, to) = (column.form.shape[0], column.form.shape[1]);
        (PI * column.column as f64 * (column.angle(row) - from) / (to - from)).cos()
    }),
    statement: |form, _, _| {
        format!(
            "something without a name acts at {}; it depends on the angle of the joint",
            form.place
        )
    },
    ..PLAIN
};

/// A smooth torque at a joint, in the angles of two joints: products of sine and cosine of one angle and of twice another; `with` holds the two.
pub(super) static TWO_ANGLES: TorqueCause = TorqueCause {
    name: UNKNOWN,
    follows: |_| "other angle",
    coefficients: &[
        ("sin_sin", "Nm"),
        ("sin_cos", "Nm"),
        ("cos_sin", "Nm"),
        ("cos_cos", "Nm"),
    ],
    price: |_| 30.0,
    may_repeat: true,
    alike_at_joints: true,
    lengths: &[0],
    forms: |cause, scene| {
        let n = scene.joints();
        let all = (0..n * n * n).map(|k| (k / (n * n), [k / n % n, k % n]));
        let pairs = all.filter(|(_, [first, second])| first != second);
        let form = |(joint, with)| TorqueForm {
            with,
            ..TorqueForm::at_joint(cause, joint, 4)
        };
        pairs.map(form).collect()
    },
    cell: |form| form.with,
    torque: ColumnTorque::Row(|column, row| {
        let [first, second] = column
            .form
            .with
            .map(|joint| column.scene.position[joint][row]);
        wave(1 - column.column / 2, first) * wave(1 + column.column, 2.0 * second)
    }),
    statement: |form, _, _| {
        let [first, second] = form.with.map(|joint| joint + 1);
        format!(
            "something without a name acts at {}; it depends on the angles of joint {first} and joint {second}",
            form.place
        )
    },
    ..PLAIN
};
