//! What is concealed, and what it changes of a rig.

use super::draw::Site;
use super::rig::{Gear, Rig};
use crate::matrix::{self, Vector};
use crate::noise::Noise;
use std::f64::consts::TAU;

/// Declares the causes, a row each: its numbers (joints and links from 0, SI), its canonical name, where it sits, what it changes of a rig, and
/// numbers of a size that drives have, drawn for a joint.
macro_rules! laws {
    (|$rig:ident; $on:ident, $draw:ident|
     $( $(#[$meta:meta])* $name:ident($($field:ident: $type:ty),+) $effect:literal at $place:expr => $change:expr, drawn $numbers:expr; )+) => {
        /// A cause.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub(super) enum Law { $( $(#[$meta])* $name($($type),+), )+ }

        #[allow(unused_variables, reason = "a row uses some of its numbers here, some there")]
        impl Law {
            pub(super) fn name(&self) -> &'static str {
                match self { $( Self::$name(..) => $effect, )+ }
            }

            pub(super) fn place(&self) -> String {
                match *self { $( Self::$name($($field),+) => $place, )+ }
            }

            pub(super) fn change(&self, $rig: &mut Rig) {
                match *self { $( Self::$name($($field),+) => $change, )+ }
            }
        }

        /// Draws a cause of each row; the last one is in no list.
        #[allow(unused_variables, reason = "some need no joint")]
        pub(super) const DRAWS: &[fn(&Site, &mut Noise) -> Law] = &[$( |$on, $draw| {
            let ($($field,)+) = $numbers;
            Law::$name($($field),+)
        }, )+];
    };
}

laws! { |rig; on, draw|
    Delay(joint: Option<usize>, s: f64) "command_delay" at joint.map_or_else(|| "arm".into(), at_joint) => match joint {
        Some(j) => rig.servos[j].delay += s,
        None => rig.servos.iter_mut().for_each(|servo| servo.delay += s),
    },
        drawn (draw.chance(0.5).then_some(on.joint), draw.uniform(0.005, 0.02));
    Offset(j: usize, rad: f64) "command_offset" at at_joint(j) => rig.servos[j].offset += rad,
        drawn (on.joint, draw.sign() * draw.uniform(0.005, 0.02));
    Gain(j: usize, factor: f64) "drive_gain" at at_joint(j) => rig.servos[j].kp *= factor,
        drawn (on.joint, either(draw, 1.2, 1.8));
    Damping(j: usize, factor: f64) "drive_damping" at at_joint(j) => rig.servos[j].kd *= factor,
        drawn (on.joint, either(draw, 1.3, 2.2));
    Rotor(j: usize, factor: f64) "rotor_inertia" at at_joint(j) => rig.servos[j].armature *= factor,
        drawn (on.joint, either(draw, 1.5, 2.5));
    Limit(j: usize, nm: f64) "torque_limit" at at_joint(j) => rig.servos[j].limit = nm,
        drawn (on.joint, on.usual.torque * draw.uniform(0.5, 0.8));
    DeadBand(j: usize, rad: f64) "dead_band" at at_joint(j) => rig.servos[j].dead_band = rad,
        drawn (on.joint, on.usual.error * draw.uniform(0.1, 0.3));
    SpeedLimit(j: usize, rate: f64) "speed_limit" at at_joint(j) => rig.servos[j].speed_limit = rate,
        drawn (on.joint, on.usual.rate * draw.uniform(0.4, 0.75));
    Integral(j: usize, both: [f64; 2]) "integral_action" at at_joint(j) => rig.servos[j].integral = both,
        drawn (on.joint, [on.servo.kp * draw.uniform(0.4, 2.0), on.usual.torque * draw.uniform(0.2, 0.5)]);
    Viscous(j: usize, b: f64) "viscous_friction" at at_joint(j) => rig.servos[j].damping += b,
        drawn (on.joint, on.usual.torque / on.usual.speed * draw.uniform(0.1, 0.3));
    Coulomb(j: usize, c: f64) "coulomb_friction" at at_joint(j) => rig.servos[j].friction += c,
        drawn (on.joint, on.usual.torque * draw.uniform(0.1, 0.3));
    Stribeck(j: usize, both: [f64; 2]) "stribeck_friction" at at_joint(j) => rig.servos[j].stribeck = both,
        drawn (on.joint, [on.usual.torque * draw.uniform(0.1, 0.3), on.usual.speed * draw.uniform(0.05, 0.2)]);
    Load(j: usize, both: [f64; 2]) "load_friction" at at_joint(j) => rig.servos[j].load = both,
        drawn {
            let mu = draw.uniform(0.1, 0.35);
            (on.joint, if draw.chance(0.5) { [mu, mu] } else { [0.0, 1.5 * mu] })
        };
    // From a few grams of grease to a gear that the whole recording does not warm: what looks so may assume less.
    WarmUp(j: usize, both: [f64; 2]) "warmup_friction" at at_joint(j) => rig.servos[j].warm_up = both,
        drawn (on.joint, [draw.uniform(0.6, 1.5), 6.0 * draw.uniform(0.0, 3.0).exp()]);
    Cable(j: usize, both: [f64; 2]) "cable_stiffness" at at_joint(j) => rig.servos[j].spring = both,
        drawn (on.joint, [on.servo.kp * draw.uniform(0.05, 0.15), draw.uniform(-0.3, 0.3)]);
    Ripple(j: usize, wave: [f64; 3]) "torque_ripple" at at_joint(j) => rig.servos[j].ripple = wave,
        drawn (on.joint, [on.usual.torque * draw.uniform(0.1, 0.25), (2 + draw.index(12)) as f64, draw.uniform(0.0, TAU)]);
    Coupling(j: usize, by: usize, share: f64) "joint_coupling" at at_joint(j) => rig.servos[j].coupled = Some((by, share)),
        drawn {
            let n = on.case.stated.joints();
            let by = (on.joint + 1 + draw.index(n - 1)) % n;
            let share = (on.usual.torque / on.case.usual(by).torque).min(1.0);
            (on.joint, by, draw.sign() * share * draw.uniform(0.1, 0.25))
        };
    Payload(mass: f64) "payload_error" at "tool".into() => {
        let tool = rig.machine.tool;
        if let Some(body) = rig.machine.links.last_mut() {
            add_point(body, mass, tool);
        }
    },
        drawn (on.case.stated.machine.links.iter().map(|link| link.mass).sum::<f64>() * draw.uniform(0.04, 0.12),);
    Centre(link: usize, shift: Vector) "link_com" at format!("link {}", link + 1) => {
        let body = &mut rig.machine.links[link];
        body.centre = matrix::add(body.centre, shift);
    },
        drawn (1 + draw.index(on.case.stated.joints() - 1), draw.vector(0.015, 0.03));
    Gravity(tilt: [f64; 2]) "gravity_direction" at "base".into() => {
        let turned = matrix::turn_by([tilt[0], tilt[1], 0.0]);
        rig.machine.gravity = matrix::direct(&turned, rig.machine.gravity);
    },
        drawn {
            let [x, y, _] = draw.vector(0.05, 0.1);
            ([x, y],)
        };
    /// Stiffness, damping.
    Elasticity(j: usize, gear: [f64; 2]) "joint_elasticity" at at_joint(j) => rig.servos[j].gear = yielding(0.0, gear),
        drawn {
            let k = on.servo.kp * draw.uniform(6.0, 30.0);
            (on.joint, [k, draw.uniform(0.05, 0.2) * (k * on.servo.armature).sqrt()])
        };
    /// Play, stiffness, damping.
    Backlash(j: usize, gear: [f64; 3]) "backlash" at at_joint(j) => rig.servos[j].gear = yielding(gear[0], [gear[1], gear[2]]),
        drawn {
            let k = on.servo.kp * draw.uniform(30.0, 60.0);
            let damping = draw.uniform(0.1, 0.3) * (k * on.servo.armature).sqrt();
            (on.joint, [draw.uniform(0.004, 0.02), k, damping])
        };
    Presliding(j: usize, travel: f64) "presliding_friction" at at_joint(j) => rig.servos[j].travel = travel,
        drawn (on.joint, draw.uniform(0.002, 0.01));
    GearLoad(j: usize, both: [f64; 2]) "load_friction" at at_joint(j) => rig.servos[j].gear_load = both,
        drawn (on.joint, [draw.uniform(0.0, 0.2), draw.uniform(0.3, 0.9)]);
    Hold(s: f64) "command_hold" at "arm".into() => rig.hold = s,
        drawn (on.case.period * (2 + draw.index(4)) as f64,);
    Sag(share: f64) "voltage_sag" at "arm".into() => rig.sag = share,
        drawn {
            let all: f64 = (0..on.case.stated.joints()).map(|joint| on.case.usual(joint).torque).sum();
            (draw.uniform(0.15, 0.4) / all,)
        };
    /// In no list: a bump of torque at an angle.
    Bump(j: usize, bump: [f64; 3]) "unknown" at at_joint(j) => rig.servos[j].bump = bump,
        drawn {
            let [low, high] = on.usual.range;
            let width = 0.25 * (high - low) * draw.uniform(0.4, 0.8);
            let size = draw.sign() * on.usual.torque * draw.uniform(0.2, 0.4);
            (on.joint, [size, draw.uniform(low + width, high - width), width])
        };
}

fn either(draw: &mut Noise, low: f64, high: f64) -> f64 {
    match draw.chance(0.5) {
        true => draw.uniform(low, high),
        false => 1.0 / draw.uniform(low, high),
    }
}

fn at_joint(joint: usize) -> String {
    format!("joint {}", joint + 1)
}

fn yielding(play: f64, [stiffness, damping]: [f64; 2]) -> Option<Gear> {
    Some(Gear {
        stiffness,
        damping,
        play,
    })
}

/// A point of mass on a body: centre and moments of both together.
fn add_point(body: &mut crate::torque::Body, mass: f64, at: Vector) {
    let whole = body.mass + mass;
    let centre = matrix::scale(
        matrix::add(
            matrix::scale(body.centre, body.mass),
            matrix::scale(at, mass),
        ),
        1.0 / whole,
    );
    for (part, from) in [(body.mass, body.centre), (mass, at)] {
        let [x, y, z] = matrix::minus(from, centre);
        let about = [
            y * y + z * z,
            -x * y,
            -x * z,
            x * x + z * z,
            -y * z,
            x * x + y * y,
        ];
        for (moment, about) in body.inertia.iter_mut().zip(about) {
            *moment += part * about;
        }
    }
    (body.mass, body.centre) = (whole, centre);
}
