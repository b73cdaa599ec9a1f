//! What rigid bodies leave out, by its physical definition: one line of [`Law`] each. Numbers are SI; joints count from 0.

use super::rigid::JointState;

/// How friction at creeping speed falls with speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fall {
    /// exp(-(|v| / speed)^exponent).
    Exponential(f64),
    /// 1 / (1 + (v / speed)^2).
    Rational,
}

/// What bends before a joint slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bristles {
    /// Bristles of one travel, which give way more and more.
    One,
    /// Bristles of two travels in parallel.
    Two,
    /// Springs of three travels that hold until they slip.
    Slipping,
}

/// An effect with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Nm s/rad; the exponent of velocity is 1 but in another form.
    Viscous {
        joint: usize,
        size: f64,
        exponent: f64,
    },
    /// Nm; rises from zero within `width`, rad/s.
    Coulomb { joint: usize, size: f64, width: f64 },
    /// Nm more in the positive direction; in another form it is a share of speed, too.
    Asymmetric {
        joint: usize,
        size: f64,
        width: f64,
        by_speed: f64,
    },
    /// Nm more at creeping speed, gone beyond `speed`, rad/s.
    Stribeck {
        joint: usize,
        size: f64,
        speed: f64,
        fall: Fall,
    },
    /// Change of Coulomb friction by bristles that bend over a travel (rad); Nm.
    Presliding {
        joint: usize,
        size: f64,
        travel: f64,
        width: f64,
        bristles: Bristles,
    },
    /// Friction as a share of what the gear transmits.
    Load {
        joint: usize,
        share: f64,
        exponent: f64,
        width: f64,
    },
    /// Friction that falls as the gear warms up: share at the begin, and time, s; exponential, in another form as 1 / (1 + t / time).
    Warmup {
        joint: usize,
        share: f64,
        time: f64,
        slow: bool,
    },
    /// Friction of a coupled pair by v_joint + ratio v_by, on both; the exponent of that velocity is 1 but in another form.
    WristCoupling {
        joint: usize,
        by: usize,
        ratio: f64,
        viscous: f64,
        coulomb: f64,
        width: f64,
        exponent: f64,
    },
    /// kg m2 at the joint.
    Rotor { joint: usize, inertia: f64 },
    /// True torque per stated torque, less 1; in another form it falls with torque, to half at so many Nm.
    TorqueConstant { joint: usize, share: f64, half: f64 },
    /// Nm; in another form a share of it comes only as the sensor warms up, within a quarter of a minute.
    Offset { joint: usize, size: f64, drift: f64 },
    /// Nm, so many per turn of the joint; in another form with an overtone, as a share.
    Ripple {
        joint: usize,
        size: f64,
        order: f64,
        phase: f64,
        overtone: f64,
    },
    /// A balancer: -size sin(q - zero), Nm; in another form a gas spring that is stiffer the more it is bent, by a share.
    Spring {
        joint: usize,
        size: f64,
        zero: f64,
        gas: f64,
    },
    /// A hose: -stiffness (q - zero), Nm/rad; hardening in another form.
    Cable {
        joint: usize,
        stiffness: f64,
        zero: f64,
        hardening: f64,
    },
    /// s that torques are logged late; in another form behind a filter of that time.
    Latency { time: f64, filter: bool },
    /// The gear swings: rad/s and damping ratio.
    Elasticity {
        joint: usize,
        frequency: f64,
        damping: f64,
    },
    /// Nm after each reversal, and its time, s; in another form half a wave.
    Backlash {
        joint: usize,
        size: f64,
        time: f64,
        wave: bool,
    },
    /// N at the tool between two times, s: half a wave, in another form a push that is held.
    Contact {
        start: f64,
        end: f64,
        force: [f64; 3],
        held: bool,
    },
    /// kg more on the tool, centre off by m.
    Payload { mass: f64, centre: [f64; 3] },
    /// Share of a link's mass; in another form bolted on so far (m) from its centre.
    LinkMass {
        link: usize,
        share: f64,
        away: [f64; 3],
    },
    /// m.
    LinkCentre { link: usize, shift: [f64; 3] },
    /// Share of a link's inertia.
    LinkInertia { link: usize, share: f64 },
    /// rad about x and y that the base is tilted by.
    Tilt { by: [f64; 2] },
    /// No entry of a library: friction of a joint by another one's position, Nm.
    Meshing {
        joint: usize,
        by: usize,
        size: f64,
        order: f64,
    },
    /// No entry of a library: friction (Nm) by a random smooth curve of speed, waves (rad s, phase, share) of it.
    SpeedCurve {
        joint: usize,
        size: f64,
        width: f64,
        waves: [[f64; 3]; 3],
    },
    /// No entry of a library: torque (Nm) by a random smooth curve of the joint's angle that no turn repeats.
    AngleCurve {
        joint: usize,
        size: f64,
        waves: [[f64; 3]; 3],
    },
    /// No entry of a library: friction (Nm) that is greater at some angles of the joint, so many a turn.
    AngleDrag {
        joint: usize,
        size: f64,
        width: f64,
        order: f64,
        phase: f64,
    },
    /// No entry of a library: a hose that drags (Nm) and turns over only after a travel of a good part of a radian.
    HoseDrag {
        joint: usize,
        size: f64,
        travel: f64,
    },
}

/// s in which the zero of a sensor warms up.
const SENSOR_WARM: f64 = 15.0;

/// What a law keeps of the past.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Past {
    bristle: [f64; 3],
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

impl Past {
    /// What a knock of unit height after each reversal is at present.
    fn knock(&mut self, v: f64, time: f64, wave: bool, step: f64) -> f64 {
        if v.abs() > 0.01 && v.signum() != self.direction {
            self.since = if self.direction == 0.0 {
                f64::INFINITY
            } else {
                0.0
            };
            self.direction = v.signum();
        }
        let since = self.since / time;
        if !since.is_finite() {
            return 0.0;
        }
        self.since += step;
        self.direction
            * if wave {
                (0.25 * std::f64::consts::PI * since.min(4.0)).sin()
            } else {
                since * (1.0 - since).exp()
            }
    }
}

fn sign(v: f64, width: f64) -> f64 {
    (v / width).tanh()
}

/// A sum of waves (rate, phase, share).
fn curve(waves: &[[f64; 3]], x: f64) -> f64 {
    waves
        .iter()
        .map(|[rate, phase, share]| share * (rate * x + phase).sin())
        .sum()
}

impl Bristles {
    /// Shares and travels, as parts of the stated one.
    fn parts(self) -> &'static [(f64, f64)] {
        match self {
            Self::One => &[(1.0, 1.0)],
            Self::Two => &[(0.6, 0.5), (0.4, 2.0)],
            Self::Slipping => &[(0.4, 0.5), (0.35, 1.0), (0.25, 2.5)],
        }
    }

    /// How far a bristle is bent after a move, in travels.
    fn bent(self, z: f64, moved: f64) -> f64 {
        match self {
            Self::Slipping => (z + moved).clamp(-1.0, 1.0),
            // Exact for a constant velocity.
            _ => moved.signum() + (z - moved.signum()) * (-moved.abs()).exp(),
        }
    }
}

impl Fall {
    fn at(self, speeds: f64) -> f64 {
        match self {
            Self::Exponential(exponent) => (-speeds.powf(exponent)).exp(),
            Self::Rational => 1.0 / (1.0 + speeds * speeds),
        }
    }
}

impl Law {
    /// Nm of the friction that warming up scales.
    pub(super) fn plain_friction(&self, state: &JointState) -> Option<(usize, f64)> {
        match *self {
            Self::Viscous {
                joint,
                size,
                exponent,
            } => {
                let v = state.v[joint];
                Some((joint, size * v.abs().powf(exponent) * v.signum()))
            }
            Self::Coulomb { joint, size, width } => {
                Some((joint, size * sign(state.v[joint], width)))
            }
            _ => None,
        }
    }

    /// Joint and torque (Nm) of what no library has.
    fn curve(&self, now: &Moment, past: &mut Past) -> Option<(usize, f64)> {
        let (q, v) = (&now.state.q, &now.state.v);
        Some(match *self {
            Self::Meshing {
                joint,
                by,
                size,
                order,
            } => (joint, size * (order * q[by]).sin() * (2.0 * q[joint]).cos()),
            Self::SpeedCurve {
                joint,
                size,
                width,
                ref waves,
            } => (
                joint,
                size * sign(v[joint], width) * curve(waves, v[joint].abs()),
            ),
            Self::AngleCurve {
                joint,
                size,
                ref waves,
            } => (joint, size * curve(waves, q[joint])),
            Self::AngleDrag {
                joint,
                size,
                width,
                order,
                phase,
            } => (
                joint,
                size * sign(v[joint], width) * (1.0 + (order * q[joint] + phase).sin()),
            ),
            Self::HoseDrag {
                joint,
                size,
                travel,
            } => {
                let moved = v[joint] * now.step / travel;
                if moved != 0.0 {
                    past.bristle[0] = Bristles::One.bent(past.bristle[0], moved);
                }
                (joint, size * past.bristle[0])
            }
            _ => return None,
        })
    }

    /// Adds its torque at each joint, Nm.
    pub(super) fn add(&self, now: &Moment, past: &mut Past, torque: &mut [f64]) {
        let v = |joint: usize| now.state.v[joint];
        let q = |joint: usize| now.state.q[joint];
        if let Some((joint, size)) = self
            .plain_friction(now.state)
            .or_else(|| self.curve(now, past))
        {
            torque[joint] += size;
        }
        match *self {
            Self::Asymmetric {
                joint,
                size,
                width,
                by_speed,
            } => {
                let there = v(joint).max(0.0);
                torque[joint] +=
                    size * ((1.0 - by_speed) * sign(v(joint), width).max(0.0) + by_speed * there);
            }
            Self::Stribeck {
                joint,
                size,
                speed,
                fall,
            } => {
                torque[joint] +=
                    size * sign(v(joint), 0.15 * speed) * fall.at(v(joint).abs() / speed);
            }
            Self::Presliding {
                joint,
                size,
                travel,
                width,
                bristles,
            } => {
                let mut kept = 0.0;
                for (z, (share, part)) in past.bristle.iter_mut().zip(bristles.parts()) {
                    let moved = v(joint) * now.step / (part * travel);
                    if moved != 0.0 {
                        *z = bristles.bent(*z, moved);
                    }
                    kept += share * *z;
                }
                torque[joint] += size * (kept - sign(v(joint), width));
            }
            Self::Load {
                joint,
                share,
                exponent,
                width,
            } => {
                let load = now.rigid[joint].abs().powf(exponent);
                torque[joint] += share * load * sign(v(joint), width);
            }
            Self::Warmup {
                joint,
                share,
                time,
                slow,
            } => {
                let cold = if slow {
                    1.0 / (1.0 + now.time / time)
                } else {
                    (-now.time / time).exp()
                };
                torque[joint] += share * cold * now.friction[joint];
            }
            Self::WristCoupling {
                joint,
                by,
                ratio,
                viscous,
                coulomb,
                width,
                exponent,
            } => {
                let x = v(joint) + ratio * v(by);
                let drag = viscous * x.abs().powf(exponent) * x.signum() + coulomb * sign(x, width);
                torque[joint] += drag;
                torque[by] += ratio * drag;
            }
            Self::Rotor { joint, inertia } => torque[joint] += inertia * now.state.a[joint],
            Self::Offset { joint, size, drift } => {
                torque[joint] += size * (1.0 - drift * (-now.time / SENSOR_WARM).exp())
            }
            Self::Ripple {
                joint,
                size,
                order,
                phase,
                overtone,
            } => {
                let turn = order * q(joint) + phase;
                torque[joint] += size * (turn.sin() + overtone * (2.0 * turn + phase).sin());
            }
            Self::Spring {
                joint,
                size,
                zero,
                gas,
            } => {
                let bend = (q(joint) - zero).sin();
                torque[joint] -= size * bend * (1.0 + gas * bend);
            }
            Self::Cable {
                joint,
                stiffness,
                zero,
                hardening,
            } => {
                let bend = q(joint) - zero;
                torque[joint] += stiffness * bend * (1.0 + hardening * bend * bend);
            }
            Self::Elasticity {
                joint,
                frequency,
                damping,
            } => {
                let [x, dx] = past.swing;
                let drive = now.rigid[joint];
                let ddx = frequency * frequency * (drive - x) - 2.0 * damping * frequency * dx;
                let dx = dx + now.step * ddx;
                past.swing = [x + now.step * dx, dx];
                torque[joint] += past.swing[0] - drive;
            }
            Self::Backlash {
                joint,
                size,
                time,
                wave,
            } => {
                torque[joint] += size * past.knock(v(joint), time, wave, now.step);
            }
            // Rigid ones are in the bodies; the recording shifts and scales; friction and curves were added above.
            _ => {}
        }
    }

    /// Begins at rest: a swinging gear hangs at its load.
    pub(super) fn begin(&self, rigid: &[f64]) -> Past {
        let swing = if let Self::Elasticity { joint, .. } = self {
            [rigid[*joint], 0.0]
        } else {
            [0.0; 2]
        };
        Past {
            swing,
            ..Past::default()
        }
    }
}
