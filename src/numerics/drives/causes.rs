//! The table of causes of drives: rows with names, and what each does to the physics.

use crate::physics::{Curve, Gear, Over, Physics};
use calib_engine::{Cause, Cell, Number, Shape};
use nalgebra::{Rotation3, Vector3};

/// What a cell does, and to what; joints and links count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Of one joint, or of all.
    Delay(Option<usize>),
    /// Command of a joint.
    Offset(usize),
    /// Commands of all joints are taken more rarely.
    Hold,
    /// Gain of joints from .. to, both inclusive.
    Gain(usize, usize),
    /// Damping of joints from .. to.
    Damping(usize, usize),
    /// Armature.
    Rotor(usize),
    /// Integral of the error.
    Integral(usize),
    /// Errors within it are not seen.
    DeadBand(usize),
    /// Less torque than believed.
    TorqueLimit(usize),
    /// The set point slews.
    SpeedLimit(usize),
    /// Voltage falls with the load of all.
    Sag,
    /// Friction by speed.
    Viscous(usize),
    /// Dry friction.
    Coulomb(usize),
    /// Dry friction that falls with speed.
    Stribeck(usize),
    /// Friction by the drive's torque; when driven back alone or both ways.
    Load(usize, bool),
    /// Friction by the torque that the gear transmits to the link; likewise.
    GearLoad(usize, bool),
    /// Friction that bends before it slides.
    Presliding(usize),
    /// Friction that goes with time.
    WarmUp(usize),
    /// Play of the gear; encoder on the link or not.
    Backlash(usize, bool),
    /// A gear that yields.
    Elasticity(usize),
    /// A spring over the own angle.
    Cable(usize),
    /// Waves a turn.
    Ripple(usize, u32),
    /// Torque of another drive is felt.
    Coupling(usize, usize),
    /// A body at the tool.
    Payload,
    /// Mass of a link.
    LinkMass(usize),
    /// Centre of a link.
    LinkCentre(usize),
    /// Gravity turned.
    Gravity,
    /// A torque over something, or friction where `true`.
    Unknown(usize, Over, bool),
}

macro_rules! causes {
    ($( $id:ident = $name:literal, $odds:literal, $sentence:literal, [$( $number:literal $unit:literal $log:literal ),*]; )*) => {
        $( static $id: Cause = Cause { name: $name, sentence: $sentence, log_prior: $odds,
            numbers: &[$( Number { name: $number, unit: $unit, by_logarithm: $log } ),*] }; )*
        /// Every cause, a row each.
        pub static CAUSES: &[&Cause] = &[$( &$id ),*];
    };
}

causes! {
    DELAY = "command_delay", -3.9, "commands reach {} later than simulated", ["delay" "s" false];
    OFFSET = "command_offset", -3.9, "the zero of the command or of the encoder is off at {}", ["offset" "rad" false];
    HOLD = "command_hold", -5.3, "{} takes commands more rarely than they are sent", ["period" "s" true];
    GAIN = "drive_gain", -3.9, "the gain of the drive at {} is another one", ["factor" "1" true];
    DAMPING = "drive_damping", -3.9, "the damping gain of the drive at {} is another one", ["factor" "1" true];
    ROTOR = "rotor_inertia", -3.9, "the rotor's inertia at {} is another one", ["factor" "1" true];
    INTEGRAL = "integral_action", -5.3, "the drive at {} integrates its error", ["ki" "Nm/(rad s)" true, "imax" "Nm" true];
    DEAD_BAND = "dead_band", -5.3, "the drive at {} does not see small errors", ["width" "rad" true];
    TORQUE_LIMIT = "torque_limit", -5.3, "the drive at {} gives less torque than simulated", ["limit" "Nm" true];
    SPEED_LIMIT = "speed_limit", -5.3, "the set point at {} moves no faster than a limit", ["limit" "rad/s" true];
    SAG = "voltage_sag", -5.3, "the supply gives way under the load of all drives: {}", ["share per torque" "1/Nm" false];
    VISCOUS = "viscous_friction", -3.9, "friction at {} grows with speed", ["b" "Nm s/rad" false];
    COULOMB = "coulomb_friction", -3.9, "dry friction at {} is another one", ["c" "Nm" false];
    STRIBECK = "stribeck_friction", -5.3, "friction at {} falls as the joint begins to move", ["s" "Nm" false, "speed" "rad/s" true];
    LOAD = "load_friction", -5.3, "friction at {} grows with the load", ["driving" "1" false, "driven back" "1" false];
    PRESLIDING = "presliding_friction", -5.3, "friction at {} bends before it slides", ["travel" "rad" true];
    WARM_UP = "warmup_friction", -6.2, "friction at {} goes as the joint warms up", ["share of dry friction" "1" false, "share of viscous friction" "1" false, "time constant" "s" true];
    BACKLASH = "backlash", -5.3, "the gear at {} has play", ["play" "rad" true, "stiffness" "Nm/rad" true];
    ELASTICITY = "joint_elasticity", -5.3, "the gear at {} yields", ["stiffness" "Nm/rad" true, "damping" "Nm s/rad" true];
    CABLE = "cable_stiffness", -5.3, "a spring pulls on {}", ["stiffness" "Nm/rad" false, "rest angle" "rad" false];
    RIPPLE = "torque_ripple", -5.3, "torque at {} comes in waves over the angle", ["cosine" "Nm" false, "sine" "Nm" false];
    COUPLING = "joint_coupling", -6.2, "the torque of another drive is felt at {}", ["share" "1" false];
    PAYLOAD = "payload_error", -4.6, "what hangs on the {} is another body", ["mass" "kg" false, "moment x" "kg m" false, "moment y" "kg m" false, "moment z" "kg m" false];
    MASS = "link_mass", -5.3, "{} has another mass", ["factor" "1" true];
    CENTRE = "link_com", -5.3, "the mass of {} is elsewhere", ["x" "m" false, "y" "m" false, "z" "m" false];
    GRAVITY = "gravity_direction", -4.6, "gravity points elsewhere: {} is not level", ["turn x" "rad" false, "turn y" "rad" false];
    UNKNOWN = "unknown", -6.2, "a torque at {} that no cause of the list makes", [];
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

/// The cells of an arm: `duration` of the recording and `period` of commands, s.
pub fn cells(physics: &Physics, usual: &[Usual], duration: f64, period: f64) -> Vec<Cell<Key>> {
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
                cause,
                place,
                log_prior,
                shapes,
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
            log_weight: 0.0,
        }
    };
    // Numbers that begin somewhere and have no small size: the whole effect is the column.
    let at = |start: &[f64], usual: &[f64]| Shape {
        start: start.to_vec(),
        usual: usual.to_vec(),
        centre: start.to_vec(),
        columns: vec![start.to_vec()],
        log_weight: 0.0,
    };
    add(
        Key::Delay(None),
        &DELAY,
        "arm".into(),
        2,
        vec![line(&[2e-3], &[0.015])],
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
                ..line(&[2e-3], &[0.015])
            }],
        );
        add(Key::Offset(j), &OFFSET, vec![line(&[2e-3], &[0.01])]);
        add(Key::Rotor(j), &ROTOR, vec![line(&[0.05], &[0.3])]);
        let ki = |per_s: f64| [(p.kp.max(1e-6) * per_s).ln(), (0.2 * top).ln()];
        add(
            Key::Integral(j),
            &INTEGRAL,
            vec![at(&ki(0.3), &[1.0, 1.0]), at(&ki(1.5), &[1.0, 1.0])],
        );
        add(
            Key::DeadBand(j),
            &DEAD_BAND,
            [0.1, 0.3, 1.0]
                .map(|w| at(&[(w * u.error.max(1e-5)).ln()], &[1.0]))
                .to_vec(),
        );
        add(
            Key::TorqueLimit(j),
            &TORQUE_LIMIT,
            [0.5, 0.7, 0.85]
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
            vec![line(&[0.02 * torque / speed], &[0.2 * torque / speed])],
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
                        log_weight: 0.0,
                    }
                })
                .to_vec(),
        );
        let load = |both: bool| {
            let mut shape = line(&[], &[0.05, 0.05]);
            shape.columns = vec![vec![if both { 0.02 } else { 0.0 }, 0.02]];
            if !both {
                shape.usual[0] = 0.0;
            }
            shape
        };
        for both in [true, false] {
            let quarter = Shape {
                log_weight: -1.4,
                ..load(both)
            };
            add(Key::Load(j, both), &LOAD, vec![quarter.clone()]);
            // A gear that locks itself is held by as much as its load is.
            let wide = Shape {
                usual: quarter.usual.iter().map(|usual| 6.0 * usual).collect(),
                ..quarter
            };
            add(Key::GearLoad(j, both), &LOAD, vec![wide]);
        }
        if p.friction > 0.0 {
            add(
                Key::Presliding(j),
                &PRESLIDING,
                [2e-3, 8e-3].map(|w: f64| at(&[w.ln()], &[1.0])).to_vec(),
            );
        }
        // Of what there is: a share of nothing has no size.
        let shares = [p.friction, p.damping].map(|friction| if friction > 0.0 { 0.7 } else { 0.0 });
        if shares != [0.0; 2] {
            let warm_up = [0.15, 0.4, 1.2].map(|w| {
                let start = vec![0.0, 0.0, (w * duration).ln()];
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
                    log_weight: 0.0,
                }
            });
            add(Key::WarmUp(j), &WARM_UP, warm_up.to_vec());
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
        let mut cable = line(&[spring], &[2.0 * spring, 0.3]);
        cable.columns = vec![vec![spring, 0.0]];
        add(Key::Cable(j), &CABLE, vec![cable]);
        for waves in RIPPLES {
            let shape = Shape {
                log_weight: -(RIPPLES.len() as f64).ln(),
                ..line(&[0.02 * torque; 2], &[0.1 * torque; 2])
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
            let sources = (3 + 3 * n) as f64;
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
        for other in (0..n).filter(|other| *other != j) {
            curve(Over::Angle(other), false, FEW);
            curve(Over::Angle(other), true, FEW);
            curve(Over::Velocity(other), false, TWO);
            curve(Over::Acceleration(other), false, TWO);
        }
    }
    all
}

/// Factors of a gain that is stated in other units or is another servo's: so far that no derivative tells it. Share of all gains that are so.
pub(crate) const FAR: [f64; 4] = [1.0 / 64.0, 1.0 / 16.0, 0.25, 4.0];
const FAR_SHARE: f64 = 0.1;

/// Waves a turn that are looked for.
const RIPPLES: [u32; 14] = [1, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20, 24, 32, 48];
/// Knots of curves over the own angle or time, over another joint's, and of a line.
const OWN: usize = 14;
const FEW: usize = 5;
const TWO: usize = 2;

impl Key {
    /// Whether with such numbers it is another machine, which only a roll-out of its own shows.
    pub fn is_rolled(self, x: &[f64]) -> bool {
        match self {
            Self::Presliding(_) | Self::Backlash(..) | Self::Elasticity(_) => true,
            Self::Gain(..) => x[0].abs() > 1.0,
            _ => false,
        }
    }

    /// Whether what it changes has a memory, so that its numbers are fitted by roll-outs of their own.
    pub fn has_memory(self) -> bool {
        matches!(
            self,
            Self::Hold
                | Self::Integral(_)
                | Self::SpeedLimit(_)
                | Self::Sag
                | Self::Presliding(_)
                | Self::Backlash(..)
                | Self::Elasticity(_)
        )
    }

    /// Puts it into a simulation with its numbers as they are fitted.
    pub fn apply(self, x: &[f64], usual: &[Usual], duration: f64, physics: &mut Physics) {
        let joints = &mut physics.joints;
        match self {
            Self::Delay(Some(j)) => joints[j].delay += x[0],
            Self::Delay(None) => joints.iter_mut().for_each(|joint| joint.delay += x[0]),
            Self::Offset(j) => joints[j].offset += x[0],
            Self::Hold => physics.hold = x[0].exp(),
            Self::Gain(a, b) => joints[a..=b]
                .iter_mut()
                .for_each(|joint| joint.kp *= x[0].exp()),
            Self::Damping(a, b) => joints[a..=b]
                .iter_mut()
                .for_each(|joint| joint.kd *= x[0].exp()),
            Self::Rotor(j) => joints[j].armature *= x[0].exp(),
            Self::Integral(j) => joints[j].integral = [x[0].exp(), x[1].exp()],
            Self::DeadBand(j) => joints[j].dead_band = x[0].exp(),
            Self::TorqueLimit(j) => joints[j].limit = joints[j].limit.min(x[0].exp()),
            Self::SpeedLimit(j) => joints[j].speed_limit = x[0].exp(),
            Self::Sag => physics.sag = x[0],
            Self::Viscous(j) => joints[j].damping += x[0],
            Self::Coulomb(j) => joints[j].friction += x[0],
            Self::Stribeck(j) => joints[j].stribeck = [x[0], x[1].exp()],
            Self::Load(j, both) => joints[j].load_friction = [if both { x[0] } else { 0.0 }, x[1]],
            Self::GearLoad(j, both) => {
                joints[j].gear_friction = [if both { x[0] } else { 0.0 }, x[1]];
            }
            Self::Presliding(j) => joints[j].presliding = x[0].exp(),
            Self::WarmUp(j) => {
                joints[j].warm_up = [x[0], x[2].exp()];
                joints[j].warm_up_viscous = x[1];
            }
            Self::Backlash(j, link) => {
                let stiffness = x[1].exp();
                let damping = 0.2 * (stiffness * joints[j].armature).sqrt();
                joints[j].gear = Some(Gear {
                    stiffness,
                    damping,
                    play: x[0].exp(),
                    encoder_on_link: link,
                });
            }
            Self::Elasticity(j) => {
                joints[j].gear = Some(Gear {
                    stiffness: x[0].exp(),
                    damping: x[1].exp(),
                    play: 0.0,
                    encoder_on_link: false,
                });
            }
            Self::Cable(j) => {
                let [k, rest] = joints[j].spring;
                let whole = k + x[0];
                let rest = if whole == 0.0 {
                    0.0
                } else {
                    (k * rest + x[0] * x[1]) / whole
                };
                joints[j].spring = [whole, rest];
            }
            Self::Ripple(j, waves) => joints[j].ripple.push([f64::from(waves), x[0], x[1]]),
            Self::Coupling(j, by) => joints[j].coupling.push((by, x[0])),
            Self::Payload => {
                let last = physics.bodies.links.len() - 1;
                let tool = physics.tool;
                let link = &mut physics.bodies.links[last];
                let moment = tool.coords * x[0] + Vector3::new(x[1], x[2], x[3]);
                let mass = (link.mass + x[0]).max(1e-6);
                let centre = (link.centre.coords * link.mass + moment) / mass;
                // What is added is a point where its moment says; for no mass, a shift of the centre alone.
                let about = |mass: f64, arm: Vector3<f64>| {
                    (nalgebra::Matrix3::identity() * arm.norm_squared() - arm * arm.transpose())
                        * mass
                };
                if x[0] > 0.0 {
                    let at = moment / x[0];
                    let near = (at - tool.coords).norm() < 0.5;
                    link.inertia += about(link.mass, link.centre.coords - centre);
                    if near {
                        link.inertia += about(x[0], at - centre);
                    }
                }
                link.mass = mass;
                link.centre = centre.into();
            }
            Self::LinkMass(l) => {
                let link = &mut physics.bodies.links[l];
                link.mass *= x[0].exp();
                link.inertia *= x[0].exp();
            }
            Self::LinkCentre(l) => physics.bodies.links[l].centre += Vector3::new(x[0], x[1], x[2]),
            Self::Gravity => {
                let turn = Rotation3::new(Vector3::new(x[0], x[1], 0.0));
                physics.bodies.gravity = turn * physics.bodies.gravity;
            }
            Self::Unknown(j, over, dry) => {
                let [from, to] = match over {
                    Over::Angle(by) => usual[by].range,
                    Over::Speed(by) => [0.0, usual[by].speed[1]],
                    Over::Velocity(by) => [-usual[by].speed[1], usual[by].speed[1]],
                    Over::Acceleration(by) => {
                        [-4.0 * usual[by].acceleration, 4.0 * usual[by].acceleration]
                    }
                    Over::Time => [0.0, duration],
                };
                let step = ((to - from) / (x.len() - 1) as f64).max(1e-9);
                joints[j].curves.push(Curve {
                    over,
                    knots: [from, step],
                    values: x.to_vec(),
                    dry,
                });
            }
        }
    }

    /// Whether it is a gear that yields.
    pub fn is_gear(self) -> bool {
        matches!(self, Self::Backlash(..) | Self::Elasticity(_))
    }

    /// Joints at which it acts, from .. to, both inclusive.
    fn joints(self) -> [usize; 2] {
        match self {
            Self::Delay(None) | Self::Hold | Self::Sag | Self::Payload | Self::Gravity => {
                [0, usize::MAX]
            }
            Self::LinkMass(link) | Self::LinkCentre(link) => [0, link],
            Self::Gain(from, to) | Self::Damping(from, to) => [from, to],
            Self::Delay(Some(j))
            | Self::Offset(j)
            | Self::Rotor(j)
            | Self::Integral(j)
            | Self::DeadBand(j)
            | Self::TorqueLimit(j)
            | Self::SpeedLimit(j)
            | Self::Viscous(j)
            | Self::Coulomb(j)
            | Self::Stribeck(j)
            | Self::Load(j, _)
            | Self::GearLoad(j, _)
            | Self::Presliding(j)
            | Self::WarmUp(j)
            | Self::Backlash(j, _)
            | Self::Elasticity(j)
            | Self::Cable(j)
            | Self::Ripple(j, _)
            | Self::Coupling(j, _)
            | Self::Unknown(j, ..) => [j, j],
        }
    }

    /// Whether both act at a joint.
    pub fn meets(self, other: Self) -> bool {
        let ([a, b], [c, d]) = (self.joints(), other.joints());
        a <= d && c <= b
    }

    /// Whether one of two must not stand beside the other: the same field of the physics.
    pub fn excludes(self, other: Self) -> bool {
        match (self, other) {
            (Self::Unknown(a, over, dry), Self::Unknown(b, by, wet)) => {
                (a, over, dry) == (b, by, wet)
            }
            (Self::Gain(a, b), Self::Gain(c, d)) | (Self::Damping(a, b), Self::Damping(c, d)) => {
                (a, b) == (c, d)
            }
            (Self::Load(a, _) | Self::GearLoad(a, _), Self::Load(b, _) | Self::GearLoad(b, _)) => {
                a == b
            }
            (
                Self::Backlash(a, _) | Self::Elasticity(a),
                Self::Backlash(b, _) | Self::Elasticity(b),
            ) => a == b,
            _ => self == other,
        }
    }
}
