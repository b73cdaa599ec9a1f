//! What is concealed, and what it changes of a rig.

use super::rig::{Gear, Rig};
use crate::matrix::{self, Vector};

/// A cause; joints and links from 0, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Law {
    Delay(Option<usize>, f64),
    Offset(usize, f64),
    Gain(usize, f64),
    Damping(usize, f64),
    Rotor(usize, f64),
    Limit(usize, f64),
    DeadBand(usize, f64),
    SpeedLimit(usize, f64),
    Integral(usize, [f64; 2]),
    Viscous(usize, f64),
    Coulomb(usize, f64),
    Stribeck(usize, [f64; 2]),
    Load(usize, [f64; 2]),
    WarmUp(usize, [f64; 2]),
    Cable(usize, [f64; 2]),
    Ripple(usize, [f64; 3]),
    Coupling(usize, usize, f64),
    Payload(f64),
    Centre(usize, Vector),
    Gravity([f64; 2]),
    /// Stiffness, damping.
    Elasticity(usize, [f64; 2]),
    /// Play, stiffness, damping.
    Backlash(usize, [f64; 3]),
    Presliding(usize, f64),
    GearLoad(usize, [f64; 2]),
    Hold(f64),
    Sag(f64),
    /// In no list: a bump of torque at an angle.
    Bump(usize, [f64; 3]),
}

impl Law {
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Delay(..) => "command_delay",
            Self::Offset(..) => "command_offset",
            Self::Gain(..) => "drive_gain",
            Self::Damping(..) => "drive_damping",
            Self::Rotor(..) => "rotor_inertia",
            Self::Limit(..) => "torque_limit",
            Self::DeadBand(..) => "dead_band",
            Self::SpeedLimit(..) => "speed_limit",
            Self::Integral(..) => "integral_action",
            Self::Viscous(..) => "viscous_friction",
            Self::Coulomb(..) => "coulomb_friction",
            Self::Stribeck(..) => "stribeck_friction",
            Self::Load(..) | Self::GearLoad(..) => "load_friction",
            Self::Elasticity(..) => "joint_elasticity",
            Self::Backlash(..) => "backlash",
            Self::Presliding(..) => "presliding_friction",
            Self::Hold(..) => "command_hold",
            Self::Sag(..) => "voltage_sag",
            Self::WarmUp(..) => "warmup_friction",
            Self::Cable(..) => "cable_stiffness",
            Self::Ripple(..) => "torque_ripple",
            Self::Coupling(..) => "joint_coupling",
            Self::Payload(..) => "payload_error",
            Self::Centre(..) => "link_com",
            Self::Gravity(..) => "gravity_direction",
            Self::Bump(..) => "unknown",
        }
    }

    pub(super) fn place(&self) -> String {
        match self {
            Self::Delay(None, _) | Self::Hold(_) | Self::Sag(_) => "arm".into(),
            Self::Payload(_) => "tool".into(),
            Self::Gravity(_) => "base".into(),
            Self::Centre(link, _) => format!("link {}", link + 1),
            Self::Delay(Some(joint), _)
            | Self::Offset(joint, _)
            | Self::Gain(joint, _)
            | Self::Damping(joint, _)
            | Self::Rotor(joint, _)
            | Self::Limit(joint, _)
            | Self::DeadBand(joint, _)
            | Self::SpeedLimit(joint, _)
            | Self::Integral(joint, _)
            | Self::Viscous(joint, _)
            | Self::Coulomb(joint, _)
            | Self::Stribeck(joint, _)
            | Self::Load(joint, _)
            | Self::WarmUp(joint, _)
            | Self::Cable(joint, _)
            | Self::Ripple(joint, _)
            | Self::Coupling(joint, ..)
            | Self::Elasticity(joint, _)
            | Self::Backlash(joint, _)
            | Self::Presliding(joint, _)
            | Self::GearLoad(joint, _)
            | Self::Bump(joint, _) => format!("joint {}", joint + 1),
        }
    }

    pub(super) fn change(&self, rig: &mut Rig) {
        let servos = &mut rig.servos;
        match *self {
            Self::Delay(None, s) => servos.iter_mut().for_each(|servo| servo.delay += s),
            Self::Delay(Some(j), s) => servos[j].delay += s,
            Self::Offset(j, rad) => servos[j].offset += rad,
            Self::Gain(j, factor) => servos[j].kp *= factor,
            Self::Damping(j, factor) => servos[j].kd *= factor,
            Self::Rotor(j, factor) => servos[j].armature *= factor,
            Self::Limit(j, nm) => servos[j].limit = nm,
            Self::DeadBand(j, rad) => servos[j].dead_band = rad,
            Self::SpeedLimit(j, rate) => servos[j].speed_limit = rate,
            Self::Integral(j, both) => servos[j].integral = both,
            Self::Viscous(j, b) => servos[j].damping += b,
            Self::Coulomb(j, c) => servos[j].friction += c,
            Self::Stribeck(j, both) => servos[j].stribeck = both,
            Self::Load(j, both) => servos[j].load = both,
            Self::WarmUp(j, both) => servos[j].warm_up = both,
            Self::Cable(j, both) => servos[j].spring = both,
            Self::Ripple(j, wave) => servos[j].ripple = wave,
            Self::Bump(j, bump) => servos[j].bump = bump,
            Self::Elasticity(j, [stiffness, damping]) => {
                servos[j].gear = Some(Gear {
                    stiffness,
                    damping,
                    play: 0.0,
                });
            }
            Self::Backlash(j, [play, stiffness, damping]) => {
                servos[j].gear = Some(Gear {
                    stiffness,
                    damping,
                    play,
                });
            }
            Self::Presliding(j, travel) => servos[j].travel = travel,
            Self::GearLoad(j, both) => servos[j].gear_load = both,
            Self::Hold(s) => rig.hold = s,
            Self::Sag(share) => rig.sag = share,
            Self::Coupling(j, by, share) => servos[j].coupled = Some((by, share)),
            Self::Payload(mass) => {
                let tool = rig.machine.tool;
                if let Some(body) = rig.machine.links.last_mut() {
                    add_point(body, mass, tool);
                }
            }
            Self::Centre(link, shift) => {
                let body = &mut rig.machine.links[link];
                body.centre = matrix::add(body.centre, shift);
            }
            Self::Gravity([x, y]) => {
                let turned = matrix::turn_by([x, y, 0.0]);
                rig.machine.gravity = matrix::direct(&turned, rig.machine.gravity);
            }
        }
    }
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
