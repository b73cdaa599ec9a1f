//! What rigid bodies leave out, by its physical definition: a row of [`laws`] each. Numbers are SI; joints count from 0.

use crate::matrix;
use crate::matrix::{Matrix, Vector, add, cross, dot, minus, scale};
use crate::way::JointState;

/// How friction at creeping speed falls with speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Fall {
    /// exp(-(|v| / speed)^exponent).
    Exponential(f64),
    /// 1 / (1 + (v / speed)^2).
    Rational,
}

/// What bends before a joint slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Bristles {
    /// Bristles of one travel, which give way more and more.
    One,
    /// Bristles of two travels in parallel.
    Two,
    /// Springs of three travels that hold until they slip.
    Slipping,
}

/// Declares what rigid bodies leave out, a row each: the function that makes it, its canonical name, where it sits (the joint or link that a number names, from 0, or a
/// place), its numbers, whether they make another form than the usual formula, and what it adds to the torque of its joint, Nm. Rows that
/// add nothing change the bodies or the recording.
macro_rules! laws {
    (|$now:ident, $past:ident| $( $(#[$meta:meta])* $name:ident $make:ident $effect:literal at $seat:tt { $($field:ident: $type:ty),* }
      other $other:expr $(=> $adds:expr)?; )+) => {
        /// An effect with its numbers.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Law { $( $(#[$meta])* $name { $($field: $type),* }, )+ }

        #[allow(unused_variables, reason = "a row uses some of its numbers here, some there")]
        impl Law {
            $( pub(super) fn $make($($field: $type),*) -> Law {
                Law::$name { $($field),* }
            } )+

            /// Its canonical name.
            pub(crate) fn name(&self) -> &'static str {
                match self { $( Self::$name { .. } => $effect, )+ }
            }

            /// What it sits on, and the number of it, from 0.
            fn seat(&self) -> (&'static str, Option<usize>) {
                match *self { $( Self::$name { $($field),* } => laws!(@seat $seat), )+ }
            }

            /// Whether it has another form than the usual formula.
            pub(super) fn is_of_another_form(&self) -> bool {
                match *self { $( Self::$name { $($field),* } => $other, )+ }
            }

            /// What it adds to the torque of its joint, Nm.
            fn adds(&self, $now: &Moment, $past: &mut Past) -> Option<f64> {
                match *self {
                    $( Self::$name { $($field),* } => {
                        let all: &[f64] = &[$($adds)?];
                        all.first().copied()
                    } )+
                }
            }
        }
    };
    (@seat $seat:ident) => { (stringify!($seat), Some($seat)) };
    (@seat $place:literal) => { ($place, None) };
}

laws! { |now, past|
    /// Nm s/rad; the exponent of velocity is 1 but in another form.
    Viscous viscous "viscous_friction" at joint { joint: usize, size: f64, exponent: f64 } other exponent != 1.0
        => viscous(now.v(joint), size, exponent);
    /// Nm; rises from zero within `width`, rad/s.
    Coulomb coulomb "coulomb_friction" at joint { joint: usize, size: f64, width: f64 } other false
        => size * sign(now.v(joint), width);
    /// Nm more in the positive direction; in another form it is a share of speed, too.
    Asymmetric asymmetric "asymmetric_friction" at joint { joint: usize, size: f64, width: f64, by_speed: f64 } other by_speed != 0.0
        => size * ((1.0 - by_speed) * sign(now.v(joint), width).max(0.0) + by_speed * now.v(joint).max(0.0));
    /// Nm more at creeping speed, gone beyond `speed`, rad/s.
    Stribeck stribeck "stribeck_friction" at joint { joint: usize, size: f64, speed: f64, fall: Fall } other fall != Fall::Exponential(1.0)
        => size * sign(now.v(joint), 0.15 * speed) * fall.at(now.v(joint).abs() / speed);
    /// Change of Coulomb friction by bristles that bend over a travel (rad); Nm.
    Presliding presliding "presliding_friction" at joint { joint: usize, size: f64, travel: f64, width: f64, bristles: Bristles }
        other bristles != Bristles::One
        => size * (past.bend(bristles, now.v(joint) * now.step, travel) - sign(now.v(joint), width));
    /// Friction as a share of what the gear transmits; in other forms by another power of it, or another share where the load drives the gear.
    Load load "load_friction" at joint { joint: usize, share: f64, back: f64, exponent: f64, width: f64 } other exponent != 1.0 || back != share => {
        let (load, turns) = (now.rigid[joint], sign(now.v(joint), width));
        let part = if load * turns < 0.0 { back } else { share };
        part * load.abs().powf(exponent) * turns
    };
    /// Friction that falls as the gear warms up: share at the begin, and time, s; exponential, in another form as 1 / (1 + t / time).
    Warmup warmup "warmup_friction" at joint { joint: usize, share: f64, time: f64, slow: bool } other slow => {
        let cold = if slow { 1.0 / (1.0 + now.time / time) } else { (-now.time / time).exp() };
        share * cold * now.friction[joint]
    };
    /// Friction of a coupled pair by v_joint + ratio v_by, on both; the exponent of that velocity is 1 but in another form.
    WristCoupling wrist_coupling "wrist_coupling" at joint {
        joint: usize, by: usize, ratio: f64, viscous: f64, coulomb: f64, width: f64, exponent: f64
    } other exponent != 1.0 => {
        let x = now.v(joint) + ratio * now.v(by);
        viscous * x.abs().powf(exponent) * x.signum() + coulomb * sign(x, width)
    };
    /// kg m2 at the joint.
    Rotor rotor "rotor_inertia" at joint { joint: usize, inertia: f64 } other false => inertia * now.state.a[joint];
    /// True torque per stated torque, less 1; in another form it falls with torque, to half at so many Nm.
    TorqueConstant torque_constant "torque_constant" at joint { joint: usize, share: f64, half: f64 } other half.is_finite();
    /// Nm; in another form a share of it comes only as the sensor warms up, within a quarter of a minute.
    Offset offset "current_offset" at joint { joint: usize, size: f64, drift: f64 } other drift != 0.0
        => size * (1.0 - drift * (-now.time / SENSOR_WARM).exp());
    /// Nm, so many per turn of the joint; in another form with an overtone, as a share.
    Ripple ripple "torque_ripple" at joint { joint: usize, size: f64, order: f64, phase: f64, overtone: f64 } other overtone != 0.0 => {
        let turn = order * now.q(joint) + phase;
        size * (turn.sin() + overtone * (2.0 * turn + phase).sin())
    };
    /// A balancer: -size sin(q - zero), Nm; in another form a gas spring that is stiffer the more it is bent, by a share.
    Spring spring "spring_balance" at joint { joint: usize, size: f64, zero: f64, gas: f64 } other gas != 0.0 => {
        let bend = (now.q(joint) - zero).sin();
        -(size * bend * (1.0 + gas * bend))
    };
    /// A hose: -stiffness (q - zero), Nm/rad; hardening in another form.
    Cable cable "cable_stiffness" at joint { joint: usize, stiffness: f64, zero: f64, hardening: f64 } other hardening != 0.0 => {
        let bend = now.q(joint) - zero;
        stiffness * bend * (1.0 + hardening * bend * bend)
    };
    /// s that torques are logged late; in another form behind a filter of that time.
    Latency latency "current_latency" at "recording" { time: f64, filter: bool } other filter;
    /// The gear swings: rad/s and damping ratio.
    Elasticity elasticity "joint_elasticity" at joint { joint: usize, frequency: f64, damping: f64 } other false
        => past.swing(now.rigid[joint], frequency, damping, now.step);
    /// Nm after each reversal, and its time, s; in another form half a wave.
    Backlash backlash "backlash_spikes" at joint { joint: usize, size: f64, time: f64, wave: bool } other wave
        => size * past.knock(now.v(joint), time, wave, now.step);
    /// Play behind the drive, rad: a link whose own friction (Nm) holds it stands while the drive crosses the play after a reversal, and neither
    /// its load nor that friction is felt so long. A load above the friction keeps the gear on its flank. In another form the last part of the
    /// play is crossed against grease.
    Play play "backlash" at joint { joint: usize, play: f64, size: f64, width: f64, grease: f64 } other grease != 0.0 => {
        let felt = past.felt(now.rigid[joint], size, now.v(joint) * now.step / play, grease);
        felt * (now.rigid[joint] + size * sign(now.v(joint), width)) - now.rigid[joint]
    };
    /// N at the tool between two times, s: half a wave, in another form a push that is held.
    Contact contact "contact" at "arm" { start: f64, end: f64, force: [f64; 3], held: bool } other held;
    /// kg more on the tool, centre off by m.
    Payload payload "payload_error" at "tool" { mass: f64, centre: [f64; 3] } other centre != [0.0; 3];
    /// Share of a link's mass; in another form bolted on so far (m) from its centre.
    LinkMass link_mass "link_mass" at link { link: usize, share: f64, away: [f64; 3] } other away != [0.0; 3];
    /// m.
    LinkCentre link_centre "link_com" at link { link: usize, shift: [f64; 3] } other false;
    /// Share of a link's inertia.
    LinkInertia link_inertia "link_inertia" at link { link: usize, share: f64 } other false;
    /// rad about x and y that the base is tilted by.
    Tilt tilt "gravity_direction" at "base" { by: [f64; 2] } other false;
    /// No entry of a library: friction of a joint by another one's position, Nm.
    Meshing meshing "unknown" at joint { joint: usize, by: usize, size: f64, order: f64 } other true
        => size * (order * now.q(by)).sin() * (2.0 * now.q(joint)).cos();
    /// No entry of a library: friction (Nm) by a random smooth curve of speed, waves (rad s, phase, share) of it.
    SpeedCurve speed_curve "unknown" at joint { joint: usize, size: f64, width: f64, waves: [[f64; 3]; 3] } other true
        => size * sign(now.v(joint), width) * curve(&waves, now.v(joint).abs());
    /// No entry of a library: torque (Nm) by a random smooth curve of the joint's angle that no turn repeats.
    AngleCurve angle_curve "unknown" at joint { joint: usize, size: f64, waves: [[f64; 3]; 3] } other true
        => size * curve(&waves, now.q(joint));
    /// No entry of a library: friction (Nm) that is greater at some angles of the joint, so many a turn.
    AngleDrag angle_drag "unknown" at joint { joint: usize, size: f64, width: f64, order: f64, phase: f64 } other true
        => size * sign(now.v(joint), width) * (1.0 + (order * now.q(joint) + phase).sin());
    /// No entry of a library: a hose that drags (Nm) and turns over only after a travel of a good part of a radian.
    HoseDrag hose_drag "unknown" at joint { joint: usize, size: f64, travel: f64 } other true
        => size * past.bend(Bristles::One, now.v(joint) * now.step, travel);
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
    /// Where the drive is in the play, from 0 at one flank to 1 at the other.
    across: f64,
}

/// A moment of the recording, before latency.
pub(super) struct Moment<'a> {
    /// s from the begin, and of a step.
    pub(crate) time: f64,
    pub(crate) step: f64,
    pub(crate) state: &'a JointState,
    /// Nm, of the rigid bodies.
    pub(crate) rigid: &'a [f64],
    /// Nm, of friction that other laws scale: viscous and Coulomb by joint.
    pub(crate) friction: &'a [f64],
}

impl Moment<'_> {
    fn q(&self, joint: usize) -> f64 {
        self.state.q[joint]
    }
    fn v(&self, joint: usize) -> f64 {
        self.state.v[joint]
    }
}

impl Past {
    /// How far bristles are bent after a move, in their travels.
    fn bend(&mut self, bristles: Bristles, way: f64, travel: f64) -> f64 {
        let mut kept = 0.0;
        for (z, (share, part)) in self.bristle.iter_mut().zip(bristles.parts()) {
            let moved = way / (part * travel);
            if moved != 0.0 {
                *z = bristles.bent(*z, moved);
            }
            kept += share * *z;
        }
        kept
    }

    /// What a swinging gear adds to what drives it, Nm.
    fn swing(&mut self, drive: f64, frequency: f64, damping: f64, step: f64) -> f64 {
        let [x, dx] = self.swing;
        let ddx = frequency * frequency * (drive - x) - 2.0 * damping * frequency * dx;
        let dx = dx + step * ddx;
        self.swing = [x + step * dx, dx];
        self.swing[0] - drive
    }

    /// Share of a link's load that its drive feels after a move in parts of the play.
    fn felt(&mut self, load: f64, friction: f64, moved: f64, grease: f64) -> f64 {
        if load.abs() > friction {
            self.across = if load > 0.0 { 1.0 } else { 0.0 };
            return 1.0;
        }
        self.across = (self.across + moved).clamp(0.0, 1.0);
        let left = match moved > 0.0 {
            true => 1.0 - self.across,
            false => self.across,
        };
        match left {
            0.0 => 1.0,
            left if left < grease => 1.0 - left / grease,
            _ if moved == 0.0 && [0.0, 1.0].contains(&self.across) => 1.0,
            _ => 0.0,
        }
    }

    /// What a knock of unit height after each reversal is at present.
    fn knock(&mut self, v: f64, time: f64, wave: bool, step: f64) -> f64 {
        if v.abs() > 0.01 && v.signum() != self.direction {
            let is_first = self.direction == 0.0;
            self.since = if is_first { f64::INFINITY } else { 0.0 };
            self.direction = v.signum();
        }
        let since = self.since / time;
        if !since.is_finite() {
            return 0.0;
        }
        self.since += step;
        let course = match wave {
            true => (0.25 * std::f64::consts::PI * since.min(4.0)).sin(),
            false => since * (1.0 - since).exp(),
        };
        self.direction * course
    }
}

fn viscous(v: f64, size: f64, exponent: f64) -> f64 {
    size * v.abs().powf(exponent) * v.signum()
}

fn sign(v: f64, width: f64) -> f64 {
    (v / width).tanh()
}

/// A sum of waves (rate, phase, share).
fn curve(waves: &[[f64; 3]], x: f64) -> f64 {
    let wave = |[rate, phase, share]: &[f64; 3]| share * (rate * x + phase).sin();
    waves.iter().map(wave).sum()
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
            } => Some((joint, viscous(state.v[joint], size, exponent))),
            Self::Coulomb { joint, size, width } => {
                Some((joint, size * sign(state.v[joint], width)))
            }
            _ => None,
        }
    }

    /// Adds its torque at each joint, Nm.
    pub(super) fn add(&self, now: &Moment, past: &mut Past, torque: &mut [f64]) {
        if let (Some(joint), Some(adds)) = (self.joint(), self.adds(now, past)) {
            torque[joint] += adds;
            if let Self::WristCoupling { by, ratio, .. } = *self {
                torque[by] += ratio * adds;
            }
        }
    }

    /// The joint that it acts on, from 0.
    pub(crate) fn joint(&self) -> Option<usize> {
        let (word, number) = self.seat();
        number.filter(|_| word == "joint")
    }

    /// Where it sits, as people write it.
    pub(crate) fn place(&self) -> String {
        match self.seat() {
            (word, Some(number)) => format!("{word} {}", number + 1),
            (place, None) => place.into(),
        }
    }

    /// What it may be called besides, at its place: a curve that no library has is also one of its kind.
    pub(super) fn kin(&self) -> &'static [&'static str] {
        match self {
            Self::Viscous { exponent, .. } if *exponent != 1.0 => &["unknown", "stribeck_friction"],
            Self::SpeedCurve { .. } => &["stribeck_friction"],
            Self::AngleCurve { .. } => &["torque_ripple"],
            Self::HoseDrag { .. } => &["presliding_friction"],
            // A hose at the joint that arms balance is a spring there.
            Self::Cable { joint: 1, .. } => &["spring_balance"],
            // What is bolted on moves the centre, too.
            Self::LinkMass { away, .. } if *away != [0.0; 3] => &["link_com"],
            _ => &[],
        }
    }

    /// Begins at rest: a swinging gear hangs at its load.
    pub(super) fn begin(&self, rigid: &[f64]) -> Past {
        let mut past = Past::default();
        if let Self::Elasticity { joint, .. } = self {
            past.swing[0] = rigid[*joint];
        }
        past
    }
}

/// A body with its mass where it is, base frame at the zero pose, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub centre: Vector,
    /// kg m2 about the centre: xx, xy, xz, yy, yz, zz.
    pub inertia: [f64; 6],
}

/// An arm of revolute joints and its bodies, base frame at the zero pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// Unit vectors of the axes.
    pub axes: Vec<Vector>,
    /// A point on each axis, m.
    pub points: Vec<Vector>,
    /// The tool point, m.
    pub tool: Vector,
    /// One a joint.
    pub links: Vec<Body>,
    /// On the last link.
    pub payload: Option<Body>,
    /// m/s2.
    pub gravity: Vector,
}

/// What a body takes: force at its centre and moment about it.
struct Load {
    centre: Vector,
    force: Vector,
    moment: Vector,
}

/// Axes and points of the joints and the frames of the links as they are now.
pub(crate) struct Pose {
    axes: Vec<Vector>,
    points: Vec<Vector>,
    frames: Vec<Matrix>,
}

impl Machine {
    pub(crate) fn pose(&self, q: &[f64]) -> Pose {
        let mut pose = Pose {
            axes: Vec::new(),
            points: Vec::new(),
            frames: Vec::new(),
        };
        let mut at = matrix::IDENTITY;
        for ((axis, point), angle) in self.axes.iter().zip(&self.points).zip(q) {
            pose.axes.push(matrix::direct(&at, *axis));
            pose.points.push(matrix::place(&at, *point));
            let about = matrix::times(&matrix::shift(*point), &matrix::turn(*axis, *angle));
            let about = matrix::times(&about, &matrix::shift(scale(*point, -1.0)));
            at = matrix::times(&at, &about);
            pose.frames.push(at);
        }
        pose
    }

    /// Nm that each joint needs for this motion, no friction.
    pub fn torque(&self, state: &JointState) -> Vec<f64> {
        let mut torque = vec![0.0; self.axes.len()];
        self.torque_at(&self.pose(&state.q), &state.v, &state.a, &mut torque);
        torque
    }

    /// The same at a pose, of speeds (rad/s) and accelerations (rad/s2).
    pub(crate) fn torque_at(&self, pose: &Pose, v: &[f64], a: &[f64], torque: &mut [f64]) {
        let n = self.axes.len();
        let (mut spin, mut turn, mut push) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        let mut before = pose.points[0];
        let mut loads: Vec<(usize, Load)> = Vec::with_capacity(n + 1);
        for j in 0..n {
            let arm = minus(pose.points[j], before);
            push = add(push, add(cross(turn, arm), cross(spin, cross(spin, arm))));
            before = pose.points[j];
            let rate = scale(pose.axes[j], v[j]);
            let gain = add(scale(pose.axes[j], a[j]), cross(spin, rate));
            turn = add(turn, gain);
            spin = add(spin, rate);
            let last = self.payload.as_ref().filter(|_| j + 1 == n);
            for body in std::iter::once(&self.links[j]).chain(last) {
                let load = self.load(body, &pose.frames[j], pose.points[j], [spin, turn, push]);
                loads.push((j, load));
            }
        }
        for (j, torque) in torque[..n].iter_mut().enumerate() {
            let moment = |load: &Load| {
                let arm = minus(load.centre, pose.points[j]);
                dot(pose.axes[j], add(load.moment, cross(arm, load.force)))
            };
            let beyond = loads.iter().filter(|(link, _)| *link >= j);
            *torque = beyond.map(|(_, load)| moment(load)).sum();
        }
    }

    fn load(
        &self,
        body: &Body,
        frame: &Matrix,
        point: Vector,
        [spin, turn, push]: [Vector; 3],
    ) -> Load {
        let centre = matrix::place(frame, body.centre);
        let arm = minus(centre, point);
        let moves = add(push, add(cross(turn, arm), cross(spin, cross(spin, arm))));
        // In the axes of the body, where its inertia does not change.
        let within = |v: Vector| matrix::see(frame, v);
        let (w, a) = (within(spin), within(turn));
        let moment = add(tensor(&body.inertia, a), cross(w, tensor(&body.inertia, w)));
        Load {
            centre,
            force: scale(minus(moves, self.gravity), body.mass),
            moment: matrix::direct(frame, moment),
        }
    }

    /// Nm at each joint that hold against a force at the tool (N, base frame).
    pub(crate) fn against(&self, q: &[f64], force: Vector) -> Vec<f64> {
        let pose = self.pose(q);
        let last = pose.frames.last();
        let tool = last.map_or(self.tool, |frame| matrix::place(frame, self.tool));
        let axes = pose.axes.iter().zip(&pose.points);
        axes.map(|(axis, point)| -dot(*axis, cross(minus(tool, *point), force)))
            .collect()
    }
}

fn tensor([xx, xy, xz, yy, yz, zz]: &[f64; 6], v: Vector) -> Vector {
    [
        xx * v[0] + xy * v[1] + xz * v[2],
        xy * v[0] + yy * v[1] + yz * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    ]
}
