//! What one recording of torques may conceal in addition to the friction of all joints: a family of effects with sizes that arms have.

use super::law::{Bristles, Fall, Law, Machine};
use crate::lists::families;
use crate::matrix;
use crate::noise::Noise;

/// From 0: the joint that a balancer hangs at.
const BALANCED: usize = 1;

/// What effects are drawn with.
pub struct Pool<'a> {
    /// The joint that it sits on, if it sits on one, from 0.
    pub(super) joint: usize,
    /// rad/s over which the sign of friction turns.
    pub(super) width: f64,
    /// Whether joints have friction that others modify.
    pub(super) common: bool,
    /// Whether torques are measured at the joints.
    pub(super) sensors: bool,
    /// Nm, by joint.
    pub(super) scale: &'a [f64],
    pub(super) machine: &'a Machine,
    /// s from the begin in which something may touch the arm.
    pub(super) touched: f64,
}

impl Pool<'_> {
    fn scale(&self) -> f64 {
        self.scale[self.joint]
    }
    /// Its scale where joints have friction, or have none.
    fn with_friction(&self, friction: bool) -> Option<f64> {
        (self.common == friction).then(|| self.scale())
    }
    /// Its scale where motors are what torques are measured by.
    fn of_motors(&self) -> Option<f64> {
        (!self.sensors).then(|| self.scale())
    }
}

/// Draws an effect, in another form where it has one; none where this arm cannot have it.
pub type DrawLaw = fn(&Pool, bool, &mut Noise) -> Option<Law>;

/// Families of [`TORQUES`], at its end, that are in no list.
pub(super) const OPEN: usize = 5;

families! {
    /// Families of effects on torques: friction, drives, bodies, and at the end what is in no list.
    TORQUES: DrawLaw, |name, on, other, draw|
    alone "asymmetric_friction" {
        let scale = on.with_friction(true)?;
        let by_speed = if other { draw.uniform(0.3, 0.7) } else { 0.0 };
        Law::asymmetric(on.joint, scale * draw.uniform(0.04, 0.1), on.width, by_speed)
    };
    alone "stribeck_friction" {
        let scale = on.with_friction(true)?;
        let falls = [Fall::Exponential(2.0), Fall::Exponential(draw.uniform(0.5, 0.8)), Fall::Rational];
        let fall = if other { falls[draw.index(falls.len())] } else { Fall::Exponential(1.0) };
        Law::stribeck(on.joint, scale * draw.uniform(0.08, 0.2), draw.uniform(0.04, 0.12), fall)
    };
    alone "presliding_friction" {
        let scale = on.with_friction(true)?;
        let (size, travel) = (scale * draw.uniform(0.08, 0.2), draw.size(0.004, 0.03));
        let bristles = if other { [Bristles::Two, Bristles::Slipping][draw.index(2)] } else { Bristles::One };
        Law::presliding(on.joint, size, travel, on.width, bristles)
    };
    alone "load_friction" {
        let scale = on.with_friction(true)?;
        let exponent: f64 = match other {
            true => [draw.uniform(0.7, 0.9), 1.0, 2.0][draw.index(3)],
            false => 1.0,
        };
        let share = draw.uniform(0.06, 0.2) * scale.powf(1.0 - exponent);
        let back = if other && exponent == 1.0 { share * draw.uniform(0.3, 0.6) } else { share };
        Law::load(on.joint, share, back, exponent, on.width)
    };
    alone "warmup_friction" {
        on.with_friction(true)?;
        Law::warmup(on.joint, draw.uniform(0.4, 1.0), draw.uniform(6.0, 14.0), other)
    };
    alone "wrist_coupling" {
        let last = on.scale.len() - 1;
        let scale = on.scale[last].min(on.scale[last - 1]);
        let (viscous, coulomb) = (scale * draw.uniform(0.1, 0.2), scale * draw.uniform(0.1, 0.2));
        let exponent = if other { draw.uniform(0.6, 0.85) } else { 1.0 };
        Law::wrist_coupling(last, last - 1, draw.sign(), viscous, coulomb, on.width, exponent)
    };
    alone "rotor_inertia" Law::rotor(on.joint, on.of_motors()? * draw.uniform(0.03, 0.08));
    alone "torque_constant" {
        let scale = on.of_motors()?;
        let share = draw.sign() * draw.uniform(0.06, 0.15);
        let (times, half) = if other { (2.0, scale) } else { (1.0, f64::INFINITY) };
        Law::torque_constant(on.joint, times * share, half)
    };
    alone "current_offset" {
        let drift = if other { draw.uniform(0.2, 0.5) } else { 0.0 };
        Law::offset(on.joint, draw.sign() * on.scale() * draw.uniform(0.03, 0.1), drift)
    };
    alone "torque_ripple" {
        let order = (1 + draw.index(6)) as f64;
        let overtone = if other { draw.uniform(0.3, 0.6) } else { 0.0 };
        Law::ripple(on.joint, on.scale() * draw.uniform(0.02, 0.06), order, draw.uniform(0.0, 6.2), overtone)
    };
    alone "spring_balance" {
        let gas = if other { draw.uniform(0.15, 0.35) } else { 0.0 };
        let size = on.scale[BALANCED] * draw.uniform(0.1, 0.25);
        Law::spring(BALANCED, size, draw.uniform(-1.5, 1.5), gas)
    };
    alone "cable_stiffness" {
        let hardening = if other { draw.uniform(0.2, 0.5) } else { 0.0 };
        Law::cable(on.joint, on.scale() * draw.uniform(0.04, 0.12), draw.uniform(-1.5, 1.5), hardening)
    };
    alone "current_latency" Law::latency(draw.uniform(0.006, 0.02), other);
    alone "joint_elasticity" Law::elasticity(on.joint, draw.uniform(18.0, 35.0), draw.uniform(0.05, 0.2));
    alone "backlash_spikes" {
        let time = draw.uniform(0.03, 0.08);
        Law::backlash(on.joint, on.scale() * draw.uniform(0.06, 0.15), time, other)
    };
    alone "backlash" {
        let scale = on.with_friction(true)?;
        let grease = if other { draw.uniform(0.2, 0.5) } else { 0.0 };
        Law::play(on.joint, draw.size(0.003, 0.02), scale * draw.uniform(0.3, 0.8), on.width, grease)
    };
    alone "contact" {
        let start = draw.uniform(2.0, on.touched - 4.0);
        let reach = matrix::norm(matrix::minus(on.machine.tool, on.machine.points[0])).max(0.3);
        let size = 0.1 * on.scale.iter().copied().fold(0.0, f64::max) / reach;
        Law::contact(start, start + draw.uniform(0.8, 1.6), draw.vector(size, 3.0 * size), other)
    };
    alone "payload_error" {
        let payload = on.machine.payload.as_ref().map_or(0.0, |payload| payload.mass);
        let centre = if other { draw.vector(0.01, 0.03) } else { [0.0; 3] };
        Law::payload(draw.sign() * payload * draw.uniform(0.1, 0.3), centre)
    };
    alone "link_mass" {
        let (link, share) = (1 + draw.index(on.scale.len() - 2), draw.sign() * draw.uniform(0.06, 0.15));
        Law::link_mass(link, share, if other { draw.vector(0.03, 0.1) } else { [0.0; 3] })
    };
    alone "link_com" Law::link_centre(1 + draw.index(on.scale.len() - 2), draw.vector(0.02, 0.05));
    alone "link_inertia" Law::link_inertia(draw.index(on.scale.len() - 1), draw.uniform(0.4, 1.0));
    alone "gravity_direction" {
        let [x, y, _] = draw.vector(0.02, 0.05);
        Law::tilt([x, y])
    };
    alone "viscous_friction" {
        let scale = on.with_friction(false)?;
        let exponent = if other { draw.uniform(0.6, 0.8) } else { 1.0 };
        Law::viscous(on.joint, scale * draw.uniform(0.04, 0.12), exponent)
    };
    alone "coulomb_friction" Law::coulomb(on.joint, on.with_friction(false)? * draw.uniform(0.05, 0.15), on.width);
    alone "unknown" {
        let n = on.scale.len();
        let by = (on.joint + 1 + draw.index(n - 1)) % n;
        Law::meshing(on.joint, by, on.scale() * draw.uniform(0.06, 0.15), (2 + draw.index(2)) as f64)
    };
    alone "unknown" Law::speed_curve(on.joint, on.scale() * draw.uniform(0.05, 0.12), on.width, waves(draw, 3.0, 9.0));
    alone "unknown" Law::angle_curve(on.joint, on.scale() * draw.uniform(0.03, 0.08), waves(draw, 1.3, 5.0));
    alone "unknown" {
        let (size, order) = (on.scale() * draw.uniform(0.05, 0.12), (1 + draw.index(3)) as f64);
        Law::angle_drag(on.joint, size, on.width, order, draw.uniform(0.0, 6.2))
    };
    alone "unknown" Law::hose_drag(on.joint, on.scale() * draw.uniform(0.05, 0.15), draw.uniform(0.1, 0.4));
}

/// Three waves of a random smooth curve: rate between two bounds, phase, share.
fn waves(draw: &mut Noise, least: f64, most: f64) -> [[f64; 3]; 3] {
    let mut wave = || {
        [
            draw.uniform(least, most),
            draw.uniform(0.0, 6.2),
            draw.uniform(0.3, 1.0),
        ]
    };
    [wave(), wave(), wave()]
}
