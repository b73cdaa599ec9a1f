//! What one recording may conceal beside the friction of all joints: a family of effects with sizes that arms have.

use super::law::{Bristles, Fall, Law};
use crate::matrix;
use crate::noise::Noise;
use crate::torque::law::Machine;

/// Families of the list; [`OPEN`] further ones are in no list.
pub(super) const FAMILIES: usize = 23;
/// Meshing with another joint, a curve of speed, a curve of angle, friction by angle, a hose that drags.
pub(super) const OPEN: usize = 5;
/// From 0: the joint that a balancer hangs at.
const BALANCED: usize = 1;

/// What effects are drawn with.
pub(super) struct Pool<'a> {
    /// rad/s over which the sign of friction turns.
    pub(crate) width: f64,
    /// Whether joints have friction that others modify.
    pub(crate) common: bool,
    /// Whether torques are measured at the joints.
    pub(crate) sensors: bool,
    /// Nm, by joint.
    pub(crate) scale: &'a [f64],
    pub(crate) machine: &'a Machine,
    /// s from the begin in which something may touch the arm.
    pub(crate) touched: f64,
}

impl Pool<'_> {
    /// An effect of a family, in another form where it has one; nothing where this arm cannot have it.
    pub(super) fn law(&self, family: usize, noise: &mut Noise, other: bool) -> Option<Law> {
        let joint = noise.index(self.scale.len());
        match family {
            0..=4 if self.common => Some(self.friction(family, joint, noise, other)),
            0..=4 => None,
            5..=14 => self.drive(family, joint, noise, other),
            15..FAMILIES => self.rest(family, joint, noise, other),
            _ => Some(self.curve(family - FAMILIES, joint, noise)),
        }
    }

    /// What modifies the friction of a joint.
    fn friction(&self, family: usize, joint: usize, noise: &mut Noise, other: bool) -> Law {
        let (scale, width) = (self.scale[joint], self.width);
        match family {
            0 => {
                let by_speed = if other { noise.uniform(0.3, 0.7) } else { 0.0 };
                Law::asymmetric(joint, scale * noise.uniform(0.04, 0.1), width, by_speed)
            }
            1 => {
                let falls = [
                    Fall::Exponential(2.0),
                    Fall::Exponential(noise.uniform(0.5, 0.8)),
                    Fall::Rational,
                ];
                let fall = if other {
                    falls[noise.index(falls.len())]
                } else {
                    Fall::Exponential(1.0)
                };
                Law::stribeck(
                    joint,
                    scale * noise.uniform(0.08, 0.2),
                    noise.uniform(0.04, 0.12),
                    fall,
                )
            }
            2 => {
                let (size, travel) = (scale * noise.uniform(0.08, 0.2), noise.size(0.004, 0.03));
                let others = [Bristles::Two, Bristles::Slipping];
                let bristles = if other {
                    others[noise.index(others.len())]
                } else {
                    Bristles::One
                };
                Law::presliding(joint, size, travel, width, bristles)
            }
            3 => {
                let exponent: f64 = if other { noise.uniform(0.7, 0.9) } else { 1.0 };
                Law::load(
                    joint,
                    noise.uniform(0.06, 0.2) * scale.powf(1.0 - exponent),
                    exponent,
                    width,
                )
            }
            _ => Law::warmup(
                joint,
                noise.uniform(0.4, 1.0),
                noise.uniform(6.0, 14.0),
                other,
            ),
        }
    }

    /// What motor, gear, cables and recording add.
    fn drive(&self, family: usize, joint: usize, noise: &mut Noise, other: bool) -> Option<Law> {
        let scale = self.scale[joint];
        let angle = |noise: &mut Noise| noise.uniform(-1.5, 1.5);
        Some(match family {
            5 => {
                let last = self.scale.len() - 1;
                let scale = self.scale[last].min(self.scale[last - 1]);
                let (viscous, coulomb) = (
                    scale * noise.uniform(0.1, 0.2),
                    scale * noise.uniform(0.1, 0.2),
                );
                let exponent = if other { noise.uniform(0.6, 0.85) } else { 1.0 };
                let by = last - 1;
                Law::wrist_coupling(
                    last,
                    by,
                    noise.sign(),
                    viscous,
                    coulomb,
                    self.width,
                    exponent,
                )
            }
            6 | 7 if self.sensors => return None,
            6 => Law::rotor(joint, scale * noise.uniform(0.03, 0.08)),
            7 => {
                let share = noise.sign() * noise.uniform(0.06, 0.15);
                let (times, half) = if other {
                    (2.0, scale)
                } else {
                    (1.0, f64::INFINITY)
                };
                Law::torque_constant(joint, times * share, half)
            }
            8 => {
                let drift = if other { noise.uniform(0.2, 0.5) } else { 0.0 };
                Law::offset(
                    joint,
                    noise.sign() * scale * noise.uniform(0.03, 0.1),
                    drift,
                )
            }
            9 => {
                let order = (1 + noise.index(6)) as f64;
                let overtone = if other { noise.uniform(0.3, 0.6) } else { 0.0 };
                Law::ripple(
                    joint,
                    scale * noise.uniform(0.02, 0.06),
                    order,
                    noise.uniform(0.0, 6.2),
                    overtone,
                )
            }
            10 => {
                let gas = if other {
                    noise.uniform(0.15, 0.35)
                } else {
                    0.0
                };
                let size = self.scale[BALANCED] * noise.uniform(0.1, 0.25);
                Law::spring(BALANCED, size, angle(noise), gas)
            }
            11 => {
                let hardening = if other { noise.uniform(0.2, 0.5) } else { 0.0 };
                Law::cable(
                    joint,
                    scale * noise.uniform(0.04, 0.12),
                    angle(noise),
                    hardening,
                )
            }
            12 => Law::latency(noise.uniform(0.006, 0.02), other),
            13 => Law::elasticity(joint, noise.uniform(18.0, 35.0), noise.uniform(0.05, 0.2)),
            _ => {
                let time = noise.uniform(0.03, 0.08);
                Law::backlash(joint, scale * noise.uniform(0.06, 0.15), time, other)
            }
        })
    }

    /// Bodies that are not as declared, pushes, and friction of a joint of an arm that has none else.
    fn rest(&self, family: usize, joint: usize, noise: &mut Noise, other: bool) -> Option<Law> {
        let n = self.scale.len();
        Some(match family {
            15 => {
                let start = noise.uniform(2.0, self.touched - 4.0);
                let reach =
                    matrix::norm(matrix::minus(self.machine.tool, self.machine.points[0])).max(0.3);
                let size = 0.1 * self.scale.iter().copied().fold(0.0, f64::max) / reach;
                let end = start + noise.uniform(0.8, 1.6);
                Law::contact(start, end, noise.vector(size, 3.0 * size), other)
            }
            16 => {
                let payload = self
                    .machine
                    .payload
                    .as_ref()
                    .map_or(0.0, |payload| payload.mass);
                let centre = if other {
                    noise.vector(0.01, 0.03)
                } else {
                    [0.0; 3]
                };
                Law::payload(noise.sign() * payload * noise.uniform(0.1, 0.3), centre)
            }
            17 => {
                let (link, share) = (
                    1 + noise.index(n - 2),
                    noise.sign() * noise.uniform(0.06, 0.15),
                );
                Law::link_mass(
                    link,
                    share,
                    if other {
                        noise.vector(0.03, 0.1)
                    } else {
                        [0.0; 3]
                    },
                )
            }
            18 => Law::link_centre(1 + noise.index(n - 2), noise.vector(0.02, 0.05)),
            19 => Law::link_inertia(noise.index(n - 1), noise.uniform(0.4, 1.0)),
            20 => {
                let [x, y, _] = noise.vector(0.02, 0.05);
                Law::tilt([x, y])
            }
            _ if self.common => return None,
            21 => {
                let exponent = if other { noise.uniform(0.6, 0.8) } else { 1.0 };
                Law::viscous(
                    joint,
                    self.scale[joint] * noise.uniform(0.04, 0.12),
                    exponent,
                )
            }
            _ => Law::coulomb(
                joint,
                self.scale[joint] * noise.uniform(0.05, 0.15),
                self.width,
            ),
        })
    }

    /// What is in no list.
    fn curve(&self, which: usize, joint: usize, noise: &mut Noise) -> Law {
        let (scale, n) = (self.scale[joint], self.scale.len());
        let waves = |noise: &mut Noise, [least, most]: [f64; 2]| {
            std::array::from_fn(|_| {
                [
                    noise.uniform(least, most),
                    noise.uniform(0.0, 6.2),
                    noise.uniform(0.3, 1.0),
                ]
            })
        };
        match which {
            0 => {
                let by = (joint + 1 + noise.index(n - 1)) % n;
                Law::meshing(
                    joint,
                    by,
                    scale * noise.uniform(0.06, 0.15),
                    (2 + noise.index(2)) as f64,
                )
            }
            1 => {
                let size = scale * noise.uniform(0.05, 0.12);
                Law::speed_curve(joint, size, self.width, waves(noise, [3.0, 9.0]))
            }
            3 => {
                let (size, order) = (
                    scale * noise.uniform(0.05, 0.12),
                    (1 + noise.index(3)) as f64,
                );
                Law::angle_drag(joint, size, self.width, order, noise.uniform(0.0, 6.2))
            }
            4 => Law::hose_drag(
                joint,
                scale * noise.uniform(0.05, 0.15),
                noise.uniform(0.1, 0.4),
            ),
            _ => Law::angle_curve(
                joint,
                scale * noise.uniform(0.03, 0.08),
                waves(noise, [1.3, 5.0]),
            ),
        }
    }
}
