//! What a simulated drive and its joint do: torques of one instant, as a function of the motion and of the physics alone.

use crate::chain::Bodies;
use nalgebra::Point3;

/// A function of one variable by its values at even knots, smooth between them (Catmull and Rom, 1974), which is held beyond them.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What it follows.
    pub over: Over,
    /// The first knot, and the distance between two.
    pub knots: [f64; 2],
    /// Nm at the knots.
    pub values: Vec<f64>,
    /// Whether it is a limit of dry friction rather than a torque.
    pub dry: bool,
}

/// What a curve follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Over {
    /// Position of a joint.
    Angle(usize),
    /// Speed of a joint without its sign.
    Speed(usize),
    /// Signed speed of a joint.
    Velocity(usize),
    /// Acceleration of a joint.
    Acceleration(usize),
    /// Time.
    Time,
}

impl Curve {
    /// Its value in a motion, Nm.
    pub fn value(&self, motion: &Motion) -> f64 {
        let x = match self.over {
            Over::Angle(joint) => motion.middle[joint],
            Over::Speed(joint) => motion.ahead[joint].abs(),
            Over::Velocity(joint) => motion.ahead[joint],
            Over::Acceleration(joint) => motion.a[joint],
            Over::Time => motion.time,
        };
        let last = self.values.len() - 1;
        let at = ((x - self.knots[0]) / self.knots[1]).clamp(0.0, last as f64);
        let k = (at as usize).min(last.saturating_sub(1));
        let t = at - k as f64;
        let value = |k: usize| self.values[k.min(last)];
        let (a, b) = (value(k), value(k + 1));
        // At an end the curve goes on as it begins.
        let before = if k > 0 { value(k - 1) } else { 2.0 * a - b };
        let after = if k + 2 <= last {
            value(k + 2)
        } else {
            2.0 * b - a
        };
        let (m, n) = (0.5 * (b - before), 0.5 * (after - a));
        a + t * (m + t * (3.0 * (b - a) - 2.0 * m - n + t * (2.0 * (a - b) + m + n)))
    }
}

/// A spring between rotor and link, with play.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gear {
    /// Nm/rad.
    pub stiffness: f64,
    /// Nm s/rad.
    pub damping: f64,
    /// rad, the whole of it.
    pub play: f64,
    /// Whether the encoder is on the link instead of the rotor.
    pub encoder_on_link: bool,
}

/// Share of the armature that is on the rotor's side of a gear that yields.
pub const ROTOR_SHARE: f64 = 0.95;

/// A joint and its drive; a value that changes nothing is 0, infinite or empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Nm/rad.
    pub kp: f64,
    /// Nm s/rad.
    pub kd: f64,
    /// Whether the commanded speed is in the damping.
    pub kd_on_error: bool,
    /// Nm.
    pub limit: f64,
    /// rad, added to the command.
    pub offset: f64,
    /// s.
    pub delay: f64,
    /// rad.
    pub dead_band: f64,
    /// rad/s of the set point.
    pub speed_limit: f64,
    /// Nm/(rad s), and the most of it, Nm.
    pub integral: [f64; 2],
    /// Nm of it where a recording begins: a drive that has held a pose has integrated what the pose needs.
    pub integral_start: f64,
    /// Nm s/rad.
    pub damping: f64,
    /// Nm.
    pub friction: f64,
    /// Nm, and rad/s in which it is gone.
    pub stribeck: [f64; 2],
    /// Nm of friction per Nm of drive torque: driving, driven back.
    pub load_friction: [f64; 2],
    /// Nm of friction per Nm that the gear gives to the link: driving, driven back; a gear that locks itself has 1 and more back.
    pub gear_friction: [f64; 2],
    /// rad until friction is whole.
    pub presliding: f64,
    /// Share of dry friction more at the beginning, and s in which it goes.
    pub warm_up: [f64; 2],
    /// Share of viscous friction more at the beginning; it goes in the same time.
    pub warm_up_viscous: f64,
    /// kg m^2.
    pub armature: f64,
    /// Nm/rad, and rad where it is at rest.
    pub spring: [f64; 2],
    /// Waves a turn, Nm of cosine and sine.
    pub ripple: Vec<[f64; 3]>,
    /// Joint whose drive's torque is felt here, and which share.
    pub coupling: Vec<(usize, f64)>,
    /// Curves without a law.
    pub curves: Vec<Curve>,
    /// A gear that yields.
    pub gear: Option<Gear>,
}

/// The whole simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Physics {
    /// Joints with their drives.
    pub joints: Vec<Joint>,
    /// What they carry.
    pub bodies: Bodies,
    /// The tool point at the reference pose, m.
    pub tool: Point3<f64>,
    /// s between two commands that are taken; 0 takes all.
    pub hold: f64,
    /// Share of the torque that is lost per Nm that all drives together give.
    pub sag: f64,
}

/// s, in which the supply's voltage follows the load.
pub const SAG_LAG: f64 = 0.02;

/// s, over which friction feels a gear's load: what it asks for is known after a step only.
pub const LOAD_LAG: f64 = 0.005;

/// A step of the motion: what is linear in the state is taken at its beginning and made implicit, everything else in its middle, so that both are
/// of second order.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Positions at the beginning: of links, then of rotors that move by themselves.
    pub q: &'a [f64],
    /// Speeds there.
    pub v: &'a [f64],
    /// Positions in the middle.
    pub middle: &'a [f64],
    /// Speeds there, as the last accelerations lead on.
    pub ahead: &'a [f64],
    /// Accelerations of the step before.
    pub a: &'a [f64],
    /// s, in the middle.
    pub time: f64,
    /// Nm of the drives, in the middle.
    pub driven: &'a [f64],
    /// Nm that links ask of their gears, over the last [`LOAD_LAG`].
    pub load: &'a [f64],
}

/// What is commanded in a step, and what a drive remembers.
#[derive(Debug, Clone, Copy, Default)]
pub struct Commanded {
    /// rad, mean over the step.
    pub angle: f64,
    /// rad/s.
    pub speed: f64,
    /// Nm of the integral of the error.
    pub integral: f64,
    /// rad of presliding, from -1 to 1 of the travel.
    pub bent: f64,
}

/// Torques on a joint.
#[derive(Debug, Clone, Copy, Default)]
pub struct Torque {
    /// All of it but dry friction, on the rotor where that moves by itself, else on the link.
    pub smooth: f64,
    /// On the link where the rotor moves by itself.
    pub link: f64,
    /// Nm, up to which dry friction holds against a motion forward and back.
    pub limit: [f64; 2],
    /// Fall of `smooth` per rad and per rad/s.
    pub stiffness: f64,
    /// See there.
    pub damping: f64,
    /// Fall of the gear's torque per rad and rad/s between its sides.
    pub gear: [f64; 2],
}

/// What a drive gives, Nm.
#[derive(Debug, Clone, Copy)]
pub struct Drive {
    /// In the middle of a step.
    pub given: f64,
    /// At its beginning, of which the implicit part leads to the middle.
    explicit: f64,
    /// Fall per rad and per rad/s.
    stiffness: f64,
    damping: f64,
}

/// The mean over a step of `h` of a set point that follows a command no faster than `limit`, and where it is then.
pub(crate) fn slewed(from: f64, command: f64, limit: f64, h: f64) -> (f64, f64) {
    let (far, way) = (command - from, limit * h);
    if far.abs() >= way {
        return (from + 0.5 * way.copysign(far), from + way.copysign(far));
    }
    (command - 0.5 * far * far.abs() / way, command)
}

impl Default for Joint {
    /// Neither drive nor friction, nor anything that limits.
    fn default() -> Self {
        Self {
            kp: 0.0,
            kd: 0.0,
            kd_on_error: false,
            limit: f64::INFINITY,
            offset: 0.0,
            delay: 0.0,
            dead_band: 0.0,
            speed_limit: f64::INFINITY,
            integral: [0.0; 2],
            integral_start: 0.0,
            damping: 0.0,
            friction: 0.0,
            stribeck: [0.0, 1.0],
            load_friction: [0.0; 2],
            gear_friction: [0.0; 2],
            presliding: 0.0,
            warm_up: [0.0, 1.0],
            warm_up_viscous: 0.0,
            armature: 0.0,
            spring: [0.0; 2],
            ripple: Vec::new(),
            coupling: Vec::new(),
            curves: Vec::new(),
            gear: None,
        }
    }
}

impl Joint {
    /// Nm of the integral of the error where a recording begins.
    pub(crate) fn begun(&self) -> f64 {
        self.integral_start
            .clamp(-self.integral[1], self.integral[1])
    }

    /// What the drive of joint `joint` gives, whose rotor is degree of freedom `rotor`; `sag` scales it.
    pub fn drive(
        &self,
        joint: usize,
        rotor: usize,
        motion: &Motion,
        commanded: &Commanded,
        sag: f64,
    ) -> Drive {
        let on_link = self.gear.is_some_and(|gear| gear.encoder_on_link);
        let seen = if on_link { joint } else { rotor };
        let speed = if self.kd_on_error {
            commanded.speed
        } else {
            0.0
        };
        let error = |q: f64| commanded.angle + self.offset - q;
        let middle = error(motion.middle[seen]);
        let band = middle.clamp(-self.dead_band, self.dead_band);
        let feels = self.dead_band == 0.0 || middle != band;
        let demand = |error: f64, v: f64| {
            let felt = if feels { error - band } else { 0.0 };
            sag * (self.kp * felt + self.kd * (speed - v) + commanded.integral)
        };
        let limit = self.limit * sag;
        let wanted = demand(middle, motion.ahead[seen]);
        let given = wanted.clamp(-limit, limit);
        if given != wanted || on_link {
            return Drive {
                given,
                explicit: given,
                stiffness: 0.0,
                damping: 0.0,
            };
        }
        Drive {
            given,
            explicit: demand(error(motion.q[seen]), motion.v[seen]),
            stiffness: if feels { self.kp * sag } else { 0.0 },
            damping: self.kd * sag,
        }
    }

    /// The torques of joint `joint`, whose rotor is degree of freedom `rotor`; `sag` scales what the drive gives.
    pub fn torque(
        &self,
        joint: usize,
        rotor: usize,
        motion: &Motion,
        commanded: &Commanded,
        sag: f64,
    ) -> Torque {
        let mut out = Torque::default();
        let (q, v) = (motion.q[rotor], motion.v[rotor]);
        let (middle, ahead) = (motion.middle[rotor], motion.ahead[rotor]);
        let drive = self.drive(joint, rotor, motion, commanded, sag);
        (out.stiffness, out.damping) = (drive.stiffness, drive.damping);
        let cold = match (self.warm_up[0], self.warm_up_viscous) {
            (0.0, 0.0) => 0.0,
            _ => libm::exp(-motion.time / self.warm_up[1]),
        };
        let damping = self.damping * (1.0 + self.warm_up_viscous * cold).max(0.0);
        out.smooth = drive.explicit - damping * v - self.spring[0] * (q - self.spring[1]);
        out.damping += damping;
        out.stiffness += self.spring[0].max(0.0);
        for [waves, cosine, sine] in &self.ripple {
            let (s, c) = libm::sincos(waves * middle);
            out.smooth += cosine * c + sine * s;
        }
        for (by, share) in &self.coupling {
            out.smooth += share * motion.driven[*by];
        }
        let mut dry = self.friction;
        if self.stribeck[0] != 0.0 {
            let ratio = ahead / self.stribeck[1];
            // Beyond it is nothing.
            if ratio.abs() < 6.0 {
                dry += self.stribeck[0] * libm::exp(-ratio * ratio);
            }
        }
        dry *= 1.0 + self.warm_up[0] * cold;
        if self.load_friction != [0.0; 2] {
            let back = drive.given * ahead < 0.0;
            dry += self.load_friction[usize::from(back)] * drive.given.abs();
        }
        for curve in &self.curves {
            let value = curve.value(motion);
            match curve.dry {
                true => dry += value,
                false => out.smooth += value,
            }
        }
        let mut limit = [dry.max(0.0); 2];
        if self.gear_friction != [0.0; 2] {
            let load = motion.load[joint];
            for (way, limit) in [1.0, -1.0].into_iter().zip(&mut limit) {
                let back = load * way < 0.0;
                *limit = (dry + self.gear_friction[usize::from(back)] * load.abs()).max(0.0);
            }
        }
        if self.presliding > 0.0 {
            let dry = limit[usize::from(ahead < 0.0)];
            // A spring in place of the stop: it bends with the way and slides when it is bent by its travel.
            out.smooth -= dry * commanded.bent;
            out.stiffness += dry / self.presliding * (1.0 - commanded.bent.abs()).max(0.0);
        } else {
            out.limit = limit;
        }
        if let Some(gear) = &self.gear {
            let (way, rate) = (q - motion.q[joint], v - motion.v[joint]);
            let half = 0.5 * gear.play;
            let between = middle - motion.middle[joint];
            let flank = between.clamp(-half, half);
            if between != flank || half == 0.0 {
                let torque = gear.stiffness * (way - flank) + gear.damping * rate;
                out.smooth -= torque;
                out.link += torque;
                out.gear = [gear.stiffness, gear.damping];
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_goes_through_its_knots_smoothly_and_is_held_beyond_them() {
        let value = |values: &[f64], x: f64| {
            let curve = Curve {
                over: Over::Time,
                knots: [1.0, 0.5],
                values: values.to_vec(),
                dry: false,
            };
            let none = Motion {
                q: &[],
                v: &[],
                middle: &[],
                ahead: &[],
                a: &[],
                time: x,
                driven: &[],
                load: &[],
            };
            curve.value(&none)
        };
        let line = [1.0, 2.0, 3.0, 4.0];
        for (x, expected) in [(0.0, 1.0), (1.2, 1.4), (2.1, 3.2), (9.0, 4.0)] {
            assert!((value(&line, x) - expected).abs() < 1e-12, "{x}");
        }
        // Of a wave of six knots a turn a broken line errs by 13 %, the curve by a few.
        let turn = std::f64::consts::TAU / 6.0;
        let wave: Vec<f64> = (0..13).map(|k| (turn * f64::from(k)).sin()).collect();
        for step in 0..40 {
            let at = 3.0 + 0.15 * f64::from(step);
            let error = value(&wave, 1.0 + 0.5 * at) - (turn * at).sin();
            assert!(error.abs() < 0.03, "{at}: {error}");
        }
    }
}
