//! What a cell of the table does to a simulation.

use crate::causes::Usual;
use crate::physics::{Curve, Gear, Over, Physics};
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
    /// Friction by the drive's torque.
    Load(usize),
    /// Friction by the torque that the gear transmits to the link.
    GearLoad(usize),
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
    /// Waves over the angle, of about so many a turn.
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

impl Key {
    /// Whether with such numbers it is another machine, which only a roll-out of its own shows.
    pub fn is_rolled(self, x: &[f64]) -> bool {
        match self {
            Self::Presliding(_) | Self::Backlash(..) | Self::Elasticity(_) => true,
            Self::Gain(..) => x[0].abs() > 1.0,
            _ => false,
        }
    }

    /// Whether it is a torque in proportion to its numbers, so that a response to them holds for all sizes.
    pub fn is_proportional(self) -> bool {
        matches!(
            self,
            Self::Offset(_)
                | Self::Viscous(_)
                | Self::Coulomb(_)
                | Self::Coupling(..)
                | Self::Unknown(..)
        )
    }

    /// Whether it follows its formula exactly: a drive's arithmetic, or rigid bodies.
    pub fn is_exact(self) -> bool {
        matches!(
            self,
            Self::Delay(_)
                | Self::Offset(_)
                | Self::Hold
                | Self::Gain(..)
                | Self::Damping(..)
                | Self::Rotor(_)
                | Self::DeadBand(_)
                | Self::TorqueLimit(_)
                | Self::SpeedLimit(_)
                | Self::Payload
                | Self::LinkMass(_)
                | Self::LinkCentre(_)
                | Self::Gravity
        )
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
            Self::Integral(j) => {
                joints[j].integral = [x[0].exp(), x[1].exp()];
                joints[j].integral_start = x[2];
            }
            Self::DeadBand(j) => joints[j].dead_band = x[0].exp(),
            Self::TorqueLimit(j) => joints[j].limit = joints[j].limit.min(x[0].exp()),
            Self::SpeedLimit(j) => joints[j].speed_limit = x[0].exp(),
            Self::Sag => physics.sag = x[0],
            Self::Viscous(j) => joints[j].damping += x[0],
            Self::Coulomb(j) => joints[j].friction += x[0],
            Self::Stribeck(j) => joints[j].stribeck = [x[0], x[1].exp()],
            Self::Load(j) => joints[j].load_friction = [x[0], x[1]],
            Self::GearLoad(j) => joints[j].gear_friction = [x[0], x[1]],
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
                    (k * rest + x[1]) / whole
                };
                joints[j].spring = [whole, rest];
            }
            Self::Ripple(j, _) => joints[j].ripple.push([x[2].exp(), x[0], x[1]]),
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
            | Self::Load(j)
            | Self::GearLoad(j)
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

    /// What a torque without a name follows, in words; nothing of one that has a name.
    pub fn follows(self) -> Option<String> {
        let Self::Unknown(_, over, dry) = self else {
            return None;
        };
        let what = match over {
            Over::Angle(by) => format!("the angle of joint {}", by + 1),
            Over::Speed(by) | Over::Velocity(by) => format!("the speed of joint {}", by + 1),
            Over::Acceleration(by) => format!("the acceleration of joint {}", by + 1),
            Over::Time => "time".into(),
        };
        let kind = if dry { "friction" } else { "torque" };
        Some(format!("{kind} over {what}"))
    }

    /// The kind of variable that a torque without a name follows; nothing of one that has a name.
    pub(crate) fn variable(self) -> Option<&'static str> {
        let Self::Unknown(joint, over, _) = self else {
            return None;
        };
        let of = |by: usize, own: &'static str, other: &'static str| match by == joint {
            true => own,
            false => other,
        };
        Some(match over {
            Over::Angle(by) => of(by, "own angle", "other angle"),
            Over::Speed(by) | Over::Velocity(by) => of(by, "own speed", "other speed"),
            Over::Acceleration(_) => "acceleration",
            Over::Time => "time",
        })
    }

    /// Whether two cells exclude each other: they set the same field of the physics.
    pub fn excludes(self, other: Self) -> bool {
        match (self, other) {
            (Self::Unknown(a, over, dry), Self::Unknown(b, by, wet)) => {
                (a, over, dry) == (b, by, wet)
            }
            (Self::Gain(a, b), Self::Gain(c, d)) | (Self::Damping(a, b), Self::Damping(c, d)) => {
                (a, b) == (c, d)
            }
            (Self::Load(a) | Self::GearLoad(a), Self::Load(b) | Self::GearLoad(b)) => a == b,
            (
                Self::Backlash(a, _) | Self::Elasticity(a),
                Self::Backlash(b, _) | Self::Elasticity(b),
            ) => a == b,
            _ => self == other,
        }
    }
}
