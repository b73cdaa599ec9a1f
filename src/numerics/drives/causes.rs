//! The table of causes of drives: rows with names, and what each does to the physics.

use crate::key::Key;
use crate::physics::{Over, Physics};
use calib_engine::{Cause, Cell, Number, Shape};
use std::borrow::Cow;

macro_rules! causes {
    ($( $id:ident = $name:literal, $follows:literal, $odds:literal, $sentence:literal, [$( $number:literal $unit:literal $log:literal ),*]; )*) => {
        $( static $id: Cause = Cause { name: Cow::Borrowed($name), follows: $follows, sentence: $sentence, log_prior: $odds,
            numbers: &[$( Number { name: $number, unit: $unit, by_logarithm: $log } ),*] }; )*
        /// Every cause, a row each.
        pub static CAUSES: &[&Cause] = &[$( &$id ),*];
    };
}

causes! {
    DELAY = "command_delay", "command", -3.9, "commands reach {} later than simulated", ["delay" "s" false];
    OFFSET = "command_offset", "constant", -3.9, "the zero of the command or of the encoder is off at {}", ["offset" "rad" false];
    HOLD = "command_hold", "command", -5.3, "{} takes commands more rarely than they are sent", ["period" "s" true];
    GAIN = "drive_gain", "error of the drive", -3.9, "the gain of the drive at {} is another one", ["factor" "1" true];
    DAMPING = "drive_damping", "own speed", -3.9, "the damping gain of the drive at {} is another one", ["factor" "1" true];
    ROTOR = "rotor_inertia", "acceleration", -3.9, "the rotor's inertia at {} is another one", ["factor" "1" true];
    INTEGRAL = "integral_action", "error of the drive", -5.3, "the drive at {} integrates its error", ["ki" "Nm/(rad s)" true, "imax" "Nm" true, "at the beginning" "Nm" false];
    DEAD_BAND = "dead_band", "error of the drive", -5.3, "the drive at {} does not see small errors", ["width" "rad" true];
    TORQUE_LIMIT = "torque_limit", "load", -5.3, "the drive at {} gives less torque than simulated", ["limit" "Nm" true];
    SPEED_LIMIT = "speed_limit", "command", -5.3, "the set point at {} moves no faster than a limit", ["limit" "rad/s" true];
    SAG = "voltage_sag", "load", -5.3, "the supply gives way under the load of all drives: {}", ["share per torque" "1/Nm" false];
    VISCOUS = "viscous_friction", "own speed", -3.9, "friction at {} grows with speed", ["viscous" "Nm s/rad" false];
    COULOMB = "coulomb_friction", "own speed", -3.9, "dry friction at {} is another one", ["coulomb" "Nm" false];
    STRIBECK = "stribeck_friction", "own speed", -5.3, "friction at {} falls as the joint begins to move", ["stribeck" "Nm" false, "speed" "rad/s" true];
    LOAD = "load_friction", "load", -5.3, "friction at {} grows with the load", ["driving" "1" false, "driven back" "1" false];
    PRESLIDING = "presliding_friction", "own speed", -5.3, "friction at {} bends before it slides", ["travel" "rad" true];
    WARM_UP = "warmup_friction", "time", -6.2, "friction at {} goes as the joint warms up", ["share of dry friction" "1" false, "share of viscous friction" "1" false, "time constant" "s" true];
    BACKLASH = "backlash", "load", -5.3, "the gear at {} has play", ["play" "rad" true, "stiffness" "Nm/rad" true];
    ELASTICITY = "joint_elasticity", "acceleration", -5.3, "the gear at {} yields", ["stiffness" "Nm/rad" true, "damping" "Nm s/rad" true];
    CABLE = "cable_stiffness", "own angle", -5.3, "a spring pulls on {}", ["stiffness" "Nm/rad" false, "rest angle" "rad" false];
    RIPPLE = "torque_ripple", "own angle", -5.3, "torque at {} comes in waves over the angle", ["cosine" "Nm" false, "sine" "Nm" false, "waves per turn" "1" true];
    COUPLING = "joint_coupling", "load", -6.2, "the torque of another drive is felt at {}", ["share" "1" false];
    PAYLOAD = "payload_error", "own angle", -4.6, "what hangs on the {} is another body", ["mass" "kg" false, "moment x" "kg m" false, "moment y" "kg m" false, "moment z" "kg m" false];
    MASS = "link_mass", "own angle", -5.3, "{} has another mass", ["factor" "1" true];
    CENTRE = "link_com", "own angle", -5.3, "the mass of {} is elsewhere", ["x" "m" false, "y" "m" false, "z" "m" false];
    GRAVITY = "gravity_direction", "own angle", -4.6, "gravity points elsewhere: {} is not level", ["turn x" "rad" false, "turn y" "rad" false];
    UNKNOWN = "unknown", "", -6.2, "a torque at {} that no cause of the list makes", [];
}

/// What the simulation as it is does at a joint: sizes of what is usual.
#[derive(Debug, Clone, Copy, Default)]
pub struct Usual {
    /// Torque of the drive, rms and most, Nm.
    pub torque: [f64; 2],
    /// Speed, rms and most, rad/s.
    pub speed: [f64; 2],
    /// Most of the commanded speed, rad/s.
    pub commanded: f64,
    /// Error of the drive, rms, rad.
    pub error: f64,
    /// Acceleration, rms, rad/s^2.
    pub acceleration: f64,
    /// From, to, rad.
    pub range: [f64; 2],
}

/// The cells of an arm: `period` of commands, s; `shown`, s from the beginning of a recording to the last row that is fitted.
pub fn cells(physics: &Physics, usual: &[Usual], period: f64, shown: f64) -> Vec<Cell<Key>> {
    let n = usual.len();
    let mut all = Vec::new();
    let mut add =
        |key: Key, cause: &'static Cause, place: String, places: usize, shapes: Vec<Shape>| {
            let count = (shapes.len() as f64).ln();
            let shapes = shapes
                .into_iter()
                .map(|shape| Shape {
                    log_weight: shape.log_weight - count,
                    ..shape
                })
                .collect();
            let log_prior = cause.log_prior - (places as f64).ln();
            all.push(Cell {
                key,
                cause: cause.clone(),
                place,
                log_prior,
                shapes,
                needs: Vec::new(),
            });
        };
    let joint = |j: usize| format!("joint {}", j + 1);
    let line = |step: &[f64], usual: &[f64]| {
        let columns = step.iter().enumerate().map(|(k, step)| {
            let mut column = vec![0.0; usual.len()];
            column[k] = *step;
            column
        });
        Shape {
            start: vec![0.0; usual.len()],
            usual: usual.to_vec(),
            centre: vec![0.0; usual.len()],
            columns: columns.collect(),
            bounds: vec![FREE; usual.len()],
            log_weight: 0.0,
        }
    };
    // A change of something that is never below nothing: it takes away no more than there is.
    let less_at_most = |there: f64, shape: Shape| Shape {
        bounds: vec![[0.0 - there, f64::INFINITY]],
        ..shape
    };
    // Numbers that begin somewhere and have no small size: the whole effect is the column.
    let at = |start: &[f64], usual: &[f64]| Shape {
        start: start.to_vec(),
        usual: usual.to_vec(),
        centre: start.to_vec(),
        columns: vec![start.to_vec()],
        bounds: vec![FREE; usual.len()],
        log_weight: 0.0,
    };
    // No drive takes a command before it is sent.
    let delays = physics.joints.iter().map(|joint| joint.delay);
    let least = delays.fold(f64::INFINITY, f64::min);
    add(
        Key::Delay(None),
        &DELAY,
        "arm".into(),
        2,
        vec![less_at_most(least, line(&[2e-3], &[0.015]))],
    );
    add(
        Key::Hold,
        &HOLD,
        "arm".into(),
        1,
        [1.5, 2.0, 2.5, 3.0, 4.0, 5.0]
            .map(|times| at(&[(times * period).ln()], &[0.0]))
            .to_vec(),
    );
    let all_torque: f64 = usual.iter().map(|u| u.torque[0]).sum();
    add(
        Key::Sag,
        &SAG,
        "arm".into(),
        1,
        vec![line(
            &[0.05 / all_torque.max(1e-6)],
            &[0.2 / all_torque.max(1e-6)],
        )],
    );
    add(
        Key::Gravity,
        &GRAVITY,
        "base".into(),
        1,
        vec![line(&[0.02, 0.02], &[0.06, 0.06])],
    );
    let mass: f64 = physics.bodies.links.iter().map(|l| l.mass).sum();
    let (dm, arm) = (0.05 * mass, 0.03);
    add(
        Key::Payload,
        &PAYLOAD,
        "tool".into(),
        1,
        vec![line(
            &[0.1 * dm, 0.1 * dm * arm, 0.1 * dm * arm, 0.1 * dm * arm],
            &[dm, dm * arm, dm * arm, dm * arm],
        )],
    );
    for j in 0..n {
        add(
            Key::LinkMass(j),
            &MASS,
            format!("link {}", j + 1),
            n,
            vec![line(&[0.05], &[0.2])],
        );
        add(
            Key::LinkCentre(j),
            &CENTRE,
            format!("link {}", j + 1),
            n,
            vec![line(&[3e-3; 3], &[0.015; 3])],
        );
        for last in j..n {
            let places = n * (n + 1) / 2;
            let place = if last == j {
                joint(j)
            } else {
                format!("joint {}-{}", j + 1, last + 1)
            };
            let mut gains = vec![line(&[0.05], &[0.5])];
            if last == j || last - j + 1 == n {
                gains.extend(FAR.map(|factor: f64| at(&[factor.ln()], &[0.7])));
            }
            let shapes = gains.len() as f64;
            for (k, shape) in gains.iter_mut().enumerate() {
                let far = (FAR_SHARE / FAR.len() as f64, 1.0 - FAR_SHARE);
                let share = if k > 0 { far.0 } else { far.1 };
                shape.log_weight = if shapes > 1.0 {
                    (share * shapes).ln()
                } else {
                    0.0
                };
            }
            add(Key::Gain(j, last), &GAIN, place.clone(), places, gains);
            add(
                Key::Damping(j, last),
                &DAMPING,
                place,
                places,
                vec![line(&[0.05], &[0.5])],
            );
        }
    }
    for (j, u) in usual.iter().enumerate() {
        let (torque, top) = (u.torque[0].max(1e-6), u.torque[1].max(1e-6));
        let (speed, fast) = (u.speed[0].max(1e-4), u.speed[1].max(1e-4));
        let p = &physics.joints[j];
        let mut add = |key: Key, cause: &'static Cause, shapes: Vec<Shape>| {
            add(key, cause, joint(j), n, shapes)
        };
        add(
            Key::Delay(Some(j)),
            &DELAY,
            vec![Shape {
                log_weight: -0.7,
                ..less_at_most(p.delay, line(&[2e-3], &[0.015]))
            }],
        );
        add(Key::Offset(j), &OFFSET, vec![line(&[2e-3], &[0.01])]);
        add(Key::Rotor(j), &ROTOR, vec![line(&[0.05], &[0.3])]);
        let ki = |per_s: f64| [(p.kp.max(1e-6) * per_s).ln(), (0.2 * top).ln(), 0.0];
        add(
            Key::Integral(j),
            &INTEGRAL,
            [0.3, 1.5]
                .map(|per_s| at(&ki(per_s), &[1.0, 1.0, 0.3 * top]))
                .to_vec(),
        );
        add(
            Key::DeadBand(j),
            &DEAD_BAND,
            [0.1, 0.2, 0.4, 0.8, 1.6]
                .map(|w| at(&[(w * u.error.max(1e-5)).ln()], &[1.0]))
                .to_vec(),
        );
        add(
            Key::TorqueLimit(j),
            &TORQUE_LIMIT,
            [0.5, 0.7, 0.85, 0.93, 0.97]
                .map(|w| at(&[(w * top).ln()], &[0.5]))
                .to_vec(),
        );
        let most = u.commanded.max(1e-3);
        add(
            Key::SpeedLimit(j),
            &SPEED_LIMIT,
            [0.4, 0.6, 0.85]
                .map(|w| at(&[(w * most).ln()], &[0.5]))
                .to_vec(),
        );
        add(
            Key::Viscous(j),
            &VISCOUS,
            // No joint speeds up by itself; where the damping of the drive is too high, friction takes it away.
            vec![less_at_most(
                p.damping + p.kd,
                line(&[0.02 * torque / speed], &[0.2 * torque / speed]),
            )],
        );
        add(
            Key::Coulomb(j),
            &COULOMB,
            vec![line(&[0.02 * torque], &[0.2 * torque])],
        );
        add(
            Key::Stribeck(j),
            &STRIBECK,
            [0.03, 0.1, 0.3]
                .map(|w| {
                    let start = vec![0.0, (w * fast).ln()];
                    Shape {
                        centre: start.clone(),
                        columns: vec![vec![0.02 * torque, start[1]]],
                        start,
                        usual: vec![0.2 * torque, 0.7],
                        bounds: vec![FREE; 2],
                        log_weight: 0.0,
                    }
                })
                .to_vec(),
        );
        let load = Shape {
            log_weight: -0.7,
            columns: vec![vec![0.02, 0.0], vec![0.0, 0.02]],
            ..line(&[], &[0.05, 0.05])
        };
        // A gear that locks itself is held by as much as its load is.
        let gear_load = Shape {
            usual: load.usual.iter().map(|usual| 6.0 * usual).collect(),
            ..load.clone()
        };
        add(Key::Load(j), &LOAD, vec![load]);
        add(Key::GearLoad(j), &LOAD, vec![gear_load]);
        if p.friction > 0.0 {
            add(
                Key::Presliding(j),
                &PRESLIDING,
                [2e-3, 8e-3].map(|w: f64| at(&[w.ln()], &[1.0])).to_vec(),
            );
        }
        // Of what there is: a share of nothing has no size.
        let shares = [p.friction, p.damping].map(|friction| if friction > 0.0 { 0.7 } else { 0.0 });
        if shares != [0.0; 2] && shown > SOONEST_WARM {
            // What takes many times longer than the recording is friction that stays.
            let longest = SLOWEST_WARM * shown;
            let mut times: Vec<f64> = WARM.into_iter().filter(|time| *time < shown).collect();
            times.push(shown);
            let warm_up = times.into_iter().map(|time| {
                let start = vec![0.0, 0.0, time.ln()];
                let columns = (0..2).filter(|k| shares[*k] > 0.0).map(|k| {
                    let mut column = start.clone();
                    column[k] = 0.05;
                    column
                });
                Shape {
                    centre: start.clone(),
                    columns: columns.collect(),
                    start: start.clone(),
                    usual: vec![shares[0], shares[1], 0.7],
                    // What is cold is stiffer: oil thins as it warms.
                    bounds: vec![
                        FREE,
                        [0.0, f64::INFINITY],
                        [SOONEST_WARM.ln(), longest.ln()],
                    ],
                    log_weight: 0.0,
                }
            });
            add(Key::WarmUp(j), &WARM_UP, warm_up.collect());
        }
        let gear = 40.0 * p.kp.max(1e-6);
        for link in [false, true] {
            let plays = [3e-3, 0.012].map(|w: f64| Shape {
                log_weight: -0.7,
                ..at(&[w.ln(), gear.ln()], &[1.0, 0.7])
            });
            add(Key::Backlash(j, link), &BACKLASH, plays.to_vec());
        }
        add(
            Key::Elasticity(j),
            &ELASTICITY,
            [8.0, 30.0]
                .map(|w| {
                    let k: f64 = w * p.kp.max(1e-6);
                    at(
                        &[
                            k.ln(),
                            (0.02 * k.sqrt() * p.armature.max(1e-9).sqrt() * 4.0).ln(),
                        ],
                        &[1.0, 1.0],
                    )
                })
                .to_vec(),
        );
        let spring = 0.02 * p.kp.max(1e-6);
        // Its torque at 0 rad is linear, where it rests is not.
        let cable = line(&[spring, 0.3 * spring], &[2.0 * spring, 0.6 * spring]);
        add(Key::Cable(j), &CABLE, vec![cable]);
        for waves in RIPPLES {
            let start = vec![0.0, 0.0, f64::from(waves).ln()];
            let shape = Shape {
                log_weight: -(RIPPLES.len() as f64).ln(),
                centre: start.clone(),
                columns: [0, 1]
                    .map(|k| {
                        let mut column = start.clone();
                        column[k] = 0.02 * torque;
                        column
                    })
                    .to_vec(),
                usual: vec![0.1 * torque, 0.1 * torque, BETWEEN_RIPPLES],
                bounds: vec![FREE; 3],
                start,
            };
            add(Key::Ripple(j, waves), &RIPPLE, vec![shape]);
        }
        for by in (0..n).filter(|by| *by != j) {
            let ratio = (torque / usual[by].torque[0].max(1e-6)).min(1.0);
            let shape = Shape {
                log_weight: -((n - 1) as f64).ln(),
                ..line(&[0.02 * ratio], &[0.1 * ratio])
            };
            add(Key::Coupling(j, by), &COUPLING, vec![shape]);
        }
        let mut curve = |over: Over, dry: bool, knots: usize| {
            let step = 0.02 * torque;
            let sources = (4 * n + 1) as f64;
            let shape = Shape {
                log_weight: -sources.ln(),
                ..line(&vec![step; knots], &vec![0.1 * torque; knots])
            };
            add(Key::Unknown(j, over, dry), &UNKNOWN, vec![shape]);
        };
        curve(Over::Angle(j), false, OWN);
        curve(Over::Angle(j), true, FEW);
        curve(Over::Speed(j), true, FEW);
        curve(Over::Time, false, OWN);
        curve(Over::Time, true, FEW);
        for other in (0..n).filter(|other| *other != j) {
            curve(Over::Angle(other), false, FEW);
            curve(Over::Angle(other), true, FEW);
            curve(Over::Velocity(other), false, TWO);
            curve(Over::Acceleration(other), false, TWO);
        }
    }
    all
}

/// A number that may have any value.
const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// s in which friction goes as a joint warms up: those from which a fit begins, and the soonest. Gears of industrial arms take minutes to hours
/// (Bittencourt and Gunnarsson, 2012; Simoni et al., 2015); 10 s is a servo of a few grams of grease, and sooner is no warmth.
const WARM: [f64; 3] = [15.0, 60.0, 300.0];
const SOONEST_WARM: f64 = 10.0;
/// Times that the recording lasts in which friction goes at most: it falls by a fifth then, which is no friction that stays.
const SLOWEST_WARM: f64 = 4.0;

/// Factors of a gain that is stated in other units or is another servo's: so far that no derivative tells it. Share of all gains that are so.
pub(crate) const FAR: [f64; 4] = [1.0 / 64.0, 1.0 / 16.0, 0.25, 4.0];
const FAR_SHARE: f64 = 0.1;

/// Waves a turn from which a fit begins, and how far, by the logarithm, the true ones may be from the nearest.
const RIPPLES: [u32; 14] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48];
const BETWEEN_RIPPLES: f64 = 0.12;
/// Knots of curves over the own angle or time, over another joint's, and of a line.
const OWN: usize = 14;
const FEW: usize = 5;
const TWO: usize = 2;
