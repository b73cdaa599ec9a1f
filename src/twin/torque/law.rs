//! What rigid bodies leave out, by its physical definition: one line of [`Law`] each. Numbers are SI; joints count from 0.

use super::rigid::JointState;

/// An effect with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Nm s/rad; the exponent of velocity is 1 but in another form.
    Viscous { joint: usize, size: f64, exponent: f64 },
    /// Nm; rises from zero within `width`, rad/s.
    Coulomb { joint: usize, size: f64, width: f64 },
    /// Nm more in the positive direction.
    Asymmetric { joint: usize, size: f64, width: f64 },
    /// Nm more at creeping speed, gone beyond `speed`, rad/s; exponent 1, or 2 (Gaussian).
    Stribeck { joint: usize, size: f64, speed: f64, exponent: f64 },
    /// Of Coulomb friction: bristles that bend over a travel (rad); in another form two kinds of them in parallel.
    Presliding { joint: usize, size: f64, travel: f64, width: f64, parallel: bool },
    /// Friction as a share of what the gear transmits.
    Load { joint: usize, share: f64, exponent: f64, width: f64 },
    /// Friction that falls as the gear warms up: share at the begin, and time, s.
    Warmup { joint: usize, share: f64, time: f64 },
    /// Friction of a coupled pair by v_joint + ratio v_by, on both.
    WristCoupling { joint: usize, by: usize, ratio: f64, viscous: f64, coulomb: f64, width: f64 },
    /// kg m2 at the joint.
    Rotor { joint: usize, inertia: f64 },
    /// True torque per stated torque, less 1.
    TorqueConstant { joint: usize, share: f64 },
    /// Nm.
    Offset { joint: usize, size: f64 },
    /// Nm, so many per turn of the joint.
    Ripple { joint: usize, size: f64, order: f64, phase: f64 },
    /// A balancer: -size sin(q - zero), Nm.
    Spring { joint: usize, size: f64, zero: f64 },
    /// A hose: -stiffness (q - zero), Nm/rad; hardening in another form.
    Cable { joint: usize, stiffness: f64, zero: f64, hardening: f64 },
    /// s that torques are logged late.
    Latency { time: f64 },
    /// The gear swings: rad/s and damping ratio.
    Elasticity { joint: usize, frequency: f64, damping: f64 },
    /// Nm after each reversal, and its time, s.
    Backlash { joint: usize, size: f64, time: f64 },
    /// N at the tool between two times, s.
    Contact { start: f64, end: f64, force: [f64; 3] },
    /// kg more on the tool, centre off by m.
    Payload { mass: f64, centre: [f64; 3] },
    /// Share of a link's mass.
    LinkMass { link: usize, share: f64 },
    /// m.
    LinkCentre { link: usize, shift: [f64; 3] },
    /// Share of a link's inertia.
    LinkInertia { link: usize, share: f64 },
    /// rad about x and y that the base is tilted by.
    Tilt { by: [f64; 2] },
    /// No entry of a library: friction of a joint by another one's position, Nm.
    Meshing { joint: usize, by: usize, size: f64, order: f64 },
}

/// What a law keeps of the past.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Past {
    bristle: [f64; 2],
    swing: [f64; 2],
    direction: f64,
    since: f64,
}

/// A moment of the recording, before latency.
pub(super) struct Moment<'a> {
    /// s from the begin, and of a step.
    pub time: f64,
    pub step: f64,
    pub state: &'a JointState,
    /// Nm, of the rigid bodies.
    pub rigid: &'a [f64],
    /// Nm, of friction that other laws scale: viscous and Coulomb by joint.
    pub friction: &'a [f64],
}

fn sign(v: f64, width: f64) -> f64 {
    (v / width).tanh()
}

impl Law {
    /// Nm of the friction that warming up scales.
    pub(super) fn plain_friction(&self, state: &JointState) -> Option<(usize, f64)> {
        match *self {
            Self::Viscous { joint, size, exponent } => {
                let v = state.v[joint];
                Some((joint, size * v.abs().powf(exponent) * v.signum()))
            }
            Self::Coulomb { joint, size, width } => Some((joint, size * sign(state.v[joint], width))),
            _ => None,
        }
    }

    /// Adds its torque at each joint, Nm.
    pub(super) fn add(&self, now: &Moment, past: &mut Past, torque: &mut [f64]) {
        let v = |joint: usize| now.state.v[joint];
        let q = |joint: usize| now.state.q[joint];
        if let Some((joint, size)) = self.plain_friction(now.state) {
            torque[joint] += size;
        }
        match *self {
            Self::Asymmetric { joint, size, width } => torque[joint] += size * sign(v(joint), width).max(0.0),
            Self::Stribeck { joint, size, speed, exponent } => {
                let fade = (-(v(joint).abs() / speed).powf(exponent)).exp();
                torque[joint] += size * sign(v(joint), 0.15 * speed) * fade;
            }
            Self::Presliding { joint, size, travel, width, parallel } => {
                let bristles = if parallel { vec![(0.6, 0.5 * travel), (0.4, 2.0 * travel)] } else { vec![(1.0, travel)] };
                let mut held = 0.0;
                for (z, (share, travel)) in past.bristle.iter_mut().zip(bristles) {
                    // Exact for a constant velocity in the step.
                    let moved = (v(joint) * now.step).abs() / travel;
                    *z = v(joint).signum() + (*z - v(joint).signum()) * (-moved).exp();
                    held += share * *z;
                }
                torque[joint] += size * (held - sign(v(joint), width));
            }
            Self::Load { joint, share, exponent, width } => {
                let load = now.rigid[joint].abs().powf(exponent);
                torque[joint] += share * load * sign(v(joint), width);
            }
            Self::Warmup { joint, share, time } => torque[joint] += share * (-now.time / time).exp() * now.friction[joint],
            Self::WristCoupling { joint, by, ratio, viscous, coulomb, width } => {
                let x = v(joint) + ratio * v(by);
                let drag = viscous * x + coulomb * sign(x, width);
                torque[joint] += drag;
                torque[by] += ratio * drag;
            }
            Self::Rotor { joint, inertia } => torque[joint] += inertia * now.state.a[joint],
            Self::Offset { joint, size } => torque[joint] += size,
            Self::Ripple { joint, size, order, phase } => torque[joint] += size * (order * q(joint) + phase).sin(),
            Self::Spring { joint, size, zero } => torque[joint] -= size * (q(joint) - zero).sin(),
            Self::Cable { joint, stiffness, zero, hardening } => {
                let bend = q(joint) - zero;
                torque[joint] += stiffness * bend * (1.0 + hardening * bend * bend);
            }
            Self::Elasticity { joint, frequency, damping } => {
                let [x, dx] = past.swing;
                let drive = now.rigid[joint];
                let ddx = frequency * frequency * (drive - x) - 2.0 * damping * frequency * dx;
                let dx = dx + now.step * ddx;
                past.swing = [x + now.step * dx, dx];
                torque[joint] += past.swing[0] - drive;
            }
            Self::Backlash { joint, size, time } => {
                if v(joint).abs() > 0.01 && v(joint).signum() != past.direction {
                    past.since = if past.direction == 0.0 { f64::INFINITY } else { 0.0 };
                    past.direction = v(joint).signum();
                }
                let since = past.since / time;
                if since.is_finite() {
                    torque[joint] += past.direction * size * since * (1.0 - since).exp();
                    past.since += now.step;
                }
            }
            Self::Meshing { joint, by, size, order } => {
                torque[joint] += size * (order * q(by)).sin() * (2.0 * q(joint)).cos();
            }
            // Rigid ones are in the bodies; the recording shifts and scales; friction was added above.
            _ => {}
        }
    }

    /// Begins at rest: a swinging gear hangs at its load.
    pub(super) fn begin(&self, rigid: &[f64]) -> Past {
        let swing = if let Self::Elasticity { joint, .. } = self { [rigid[*joint], 0.0] } else { [0.0; 2] };
        Past { swing, ..Past::default() }
    }
}
