//! What sits on a joint: its spring, its gear, its friction, its bearing, its zero, its hoses, its log.

use super::{Act, Motion, State, Stated, TrueValue, angle_of, effect, sine_and_cosine};
use crate::matrix;
use crate::memory::{self, Moment};
use crate::truth::ARCSEC;
use crate::truth::true_values;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

effect! {
    /// A linear torsion spring between motor and link.
    JointCompliance "joint_compliance" at joint {
        rad_per_nm: f64 = "Wind-up per torque, rad/Nm.",
    }
    scaled by rad_per_nm;
    truth |self| [("", "rad/Nm", self.rad_per_nm)];
    turns |self, at| self.rad_per_nm * at.torque();
}

/// The form of the nonlinear wind-up, of amplitude 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Curve {
    /// `tanh(torque / scale)`: lost motion and soft first contact that is used up at a few `scale`.
    Tanh,
    /// `-(torque / scale)^3`: the spring stiffens with torque; at `scale` it holds back the whole amplitude.
    Cubic,
    /// `torque / scale` held between -1 and 1: two slopes, soft up to `scale`.
    TwoSlope,
    /// `-load abs(load)` with `load = torque / scale`: stiffens, less abruptly than the cube.
    Square,
}

// A gear that is softer under little torque than under much: teeth and rollers that first have to come into full contact.
effect! {
    /// Wind-up that is added to the linear one.
    JointHardening "joint_hardening" at joint {
        curve: Curve = "Over the torque.",
        amplitude_arcsec: f64 = "arcsec.",
        scale_nm: f64 = "The torque that sets the scale of the curve, Nm.",
    }
    scaled by amplitude_arcsec;
    truth |self| [("amplitude", "arcsec", self.amplitude_arcsec), ("scale", "Nm", self.scale_nm)];
    turns |self, at| {
        let load = at.torque() / self.scale_nm;
        let shape = match self.curve {
            Curve::Tanh => load.tanh(),
            Curve::Cubic => -load.powi(3),
            Curve::TwoSlope => load.clamp(-1.0, 1.0),
            Curve::Square => -load * load.abs(),
        };
        self.amplitude_arcsec * ARCSEC * shape
    };
}

effect! {
    /// Wind-up `direction torque` times half the difference of the two compliances.
    JointHysteresis "backlash" at joint {
        rad_per_nm: f64 = "Compliance after an upward move less that after a downward one, rad/Nm.",
    }
    scaled by rad_per_nm;
    truth |self| [("compliance", "rad/Nm", self.rad_per_nm)];
    turns |self, at| 0.5 * self.rad_per_nm * at.torque() * at.side();
}

// A mesh is also softer with fewer teeth in contact, so that the wind-up itself repeats: that part grows with the torque.
effect! {
    /// `(amplitude + arcsec_per_nm torque) sin(order q + phase)`.
    GearCyclic "gear_cyclic" at joint {
        order: f64 = "Periods per turn of the joint.",
        #[serde(default)] amplitude_arcsec: f64 = "arcsec.",
        #[serde(default)] arcsec_per_nm: f64 = "Growth of the amplitude with the load, arcsec per Nm.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec arcsec_per_nm;
    truth |self| {
        let growth = (format!("growth{}", self.order), "arcsec/Nm", self.arcsec_per_nm);
        let waves = sine_and_cosine(self.order, "arcsec", self.amplitude_arcsec, self.phase_deg);
        waves.into_iter().chain((self.arcsec_per_nm != 0.0).then_some(growth))
    };
    turns |self, at| (self.amplitude_arcsec + self.arcsec_per_nm * at.torque()) * ARCSEC * at.wave(self.order, self.phase_deg);
}

effect! {
    /// `amplitude sin(order N q + phase)` with the reduction ratio N.
    GearMotorCyclic "gear_motor_cyclic" at joint {
        order: f64 = "Periods per turn of the motor.",
        amplitude_arcsec: f64 = "arcsec at the joint.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec;
    truth |self| sine_and_cosine(self.order, "arcsec", self.amplitude_arcsec, self.phase_deg);
    turns |self, at| {
        let motor = at.angle() * at.state.arm.links[at.joint].gear;
        self.amplitude_arcsec * ARCSEC * (self.order * motor + self.phase_deg.to_radians()).sin()
    };
}

// A wheel or code disc set off its centre by much: the error repeats with every turn but is no pure sine.
effect! {
    /// `amplitude sin u / (1 + skew cos u)` with `u = order q + phase`: higher harmonics fall by about half the skew each.
    GearEccentricity "gear_cyclic" at joint {
        order: f64 = "Periods per turn of the joint.",
        amplitude_arcsec: f64 = "arcsec.",
        skew: f64 = "Below 1.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec;
    truth |self| [("eccentricity", "arcsec", self.amplitude_arcsec)];
    turns |self, at| {
        let (sine, cosine) = (self.order * at.angle() + self.phase_deg.to_radians()).sin_cos();
        self.amplitude_arcsec * ARCSEC * sine / (1.0 + self.skew * cosine)
    };
}

// Two flanks of a wheel's teeth, ground in two settings: the joint runs on the one that drives it.
effect! {
    /// `amplitude sin(order q + phase)` on the flank that drives upwards, minus as much on the other; nothing before the first move.
    GearFlank "gear_flank" at joint {
        order: f64 = "Periods per turn of the joint.",
        amplitude_arcsec: f64 = "Half the difference of the two flanks, arcsec.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec;
    truth |self| sine_and_cosine(self.order, "arcsec", self.amplitude_arcsec, self.phase_deg);
    turns |self, at| ARCSEC * (self.amplitude_arcsec * at.wave(self.order, self.phase_deg)) * at.side();
}

// A soft mesh, teeth that share the load unevenly.
effect! {
    /// `arcsec_per_nm load sin(order q + phase)`; the load saturates as `full tanh(torque / full)`.
    GearLoad "gear_load" at joint {
        order: f64 = "Periods per turn of the joint.",
        arcsec_per_nm: f64 = "Amplitude for each Nm of load.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
        #[serde(default)] full_nm: f64 = "Torque at which the mesh is fully in contact, Nm; 0: it never is.",
    }
    scaled by arcsec_per_nm;
    truth |self| sine_and_cosine(self.order, "arcsec/Nm", self.arcsec_per_nm, self.phase_deg);
    turns |self, at| ARCSEC * self.arcsec_per_nm * saturated(at.torque(), self.full_nm) * at.wave(self.order, self.phase_deg);
}

/// `full tanh(x / full)`; at a `full` of 0 it does not saturate.
fn saturated(x: f64, full: f64) -> f64 {
    if full > 0.0 {
        full * (x / full).tanh()
    } else {
        x
    }
}

// The joint stops short on the side from which it comes, unless the load holds the teeth together.
effect! {
    /// Half a gap either way: by the direction of approach where the load is light, by the load where it is not. Teeth and bearings
    /// under load also give back less than they took: the loop opens with the torque.
    Backlash "backlash" at joint {
        gap_arcsec: f64 = "The whole gap, arcsec.",
        #[serde(default)] arcsec_per_nm: f64 = "Growth of the gap with the torque, arcsec per Nm: the hysteresis of the loaded gear.",
        #[serde(default)] closing_nm: f64
            = "The torque that pushes the teeth to one side whatever the direction, Nm; 0: direction alone decides.",
        #[serde(default)] soft_nm: f64
            = "Over about this torque the load carries the joint from one side of the gap to the other, Nm; 0: at once, as `closing_nm` says.",
    }
    scaled by gap_arcsec arcsec_per_nm;
    truth |self| [
        ("gap", "arcsec", self.gap_arcsec),
        ("growth", "arcsec/Nm", self.arcsec_per_nm),
        ("closing", "Nm", self.closing_nm),
        ("soft", "Nm", self.soft_nm),
    ];
    turns |self, at| {
        let torque = at.torque();
        let side = if self.soft_nm > 0.0 {
            (torque / self.soft_nm).tanh()
        } else if self.closing_nm > 0.0 && torque.abs() > self.closing_nm {
            torque.signum()
        } else {
            // The link trails the motor by half the gap.
            -at.side()
        };
        // Hysteresis follows the direction even where the load has closed the gap.
        let loop_arcsec = self.arcsec_per_nm * torque.abs() * -at.side();
        0.5 * ARCSEC * (self.gap_arcsec * side + loop_arcsec)
    };
}

effect! {
    /// Half the gap against the last motion; `start` of it is there at first, the rest grows.
    BacklashGrowth "backlash" at joint {
        gap_arcsec: f64 = "The whole gap when it has grown, arcsec.",
        #[serde(default)] start: f64 = "Share of it at time 0.",
        time_s: f64 = "Time in which it grows, s: straight, and on beyond.",
        #[serde(default)] settling: bool = "It grows as `1 - exp(-t / time)` instead.",
    }
    scaled by gap_arcsec;
    truth |self| [("grown", "arcsec", self.gap_arcsec), ("time", "s", self.time_s)];
    turns |self, at| {
        let u = at.state.row.time_s / self.time_s;
        let grown = if self.settling { 1.0 - (-u).exp() } else { u };
        let gap = self.gap_arcsec * (self.start + (1.0 - self.start) * grown);
        -(0.5 * ARCSEC * gap * at.side())
    };
}

// Friction before it slides: after each reversal lost motion builds up over a travel, instead of at once as in a gap.
// P. R. Dahl, 1968: `dz = (s - z) |dq| / travel`, s the direction of motion. Maxwell slip: elastic elements side by side, each of
// which slips at its own travel (stop operators of Prandtl and Ishlinskii).
effect! {
    /// A joint that stops short of where its motor stands, by up to `amplitude` against the last motion.
    Presliding "presliding" at joint {
        amplitude_arcsec: f64 = "Lost motion when all slides, arcsec: half of the loop.",
        #[serde(default)] dahl_deg: f64 = "Travel of Dahl's law, deg; 0: none.",
        #[serde(default)] slip_deg: Vec<f64> = "Travel at which each element of equal force slips, deg; for Maxwell slip.",
    }
    scaled by amplitude_arcsec;
    truth |self| {
        let slip = self.slip_deg.iter().sum::<f64>() / self.slip_deg.len().max(1) as f64;
        let travel = if self.dahl_deg > 0.0 { self.dahl_deg } else { slip };
        [("amplitude", "arcsec", self.amplitude_arcsec), ("travel", "deg", travel)]
    };
    turns |self, at| -(self.amplitude_arcsec * ARCSEC * at.state.memory);
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        if self.dahl_deg > 0.0 { self.dahl(past) } else { self.maxwell(past) }
    }
}

impl Presliding {
    fn dahl(&self, past: &[Moment]) -> Vec<f64> {
        let (travel, mut z) = (self.dahl_deg.to_radians(), 0.0);
        let live = |moment: &Moment| {
            for way in moment.travels(self.joint).filter(|way| *way != 0.0) {
                z = way.signum() + (z - way.signum()) * (-way.abs() / travel).exp();
            }
            z
        };
        past.iter().map(live).collect()
    }

    fn maxwell(&self, past: &[Moment]) -> Vec<f64> {
        let limit = |slip: &f64| slip.to_radians().max(f64::MIN_POSITIVE);
        let limits: Vec<f64> = self.slip_deg.iter().map(limit).collect();
        let mut stretch = vec![0.0; limits.len()];
        let live = |moment: &Moment| {
            for way in moment.travels(self.joint) {
                for (stretch, limit) in stretch.iter_mut().zip(&limits) {
                    *stretch = (*stretch + way).clamp(-limit, *limit);
                }
            }
            let forces = stretch.iter().zip(&limits).map(|(s, limit)| s / limit);
            forces.sum::<f64>() / limits.len().max(1) as f64
        };
        past.iter().map(live).collect()
    }
}

// Friction of grease and seals that grows with speed winds a gear up.
effect! {
    /// The output of a joint trails behind its motor while it turns.
    ViscousWindup "viscous_windup" at joint {
        arcsec_per_deg_s: f64 = "Arcsec for each deg/s (um for each mm/s of a prismatic joint), at 20 deg/s.",
        #[serde(default = "one")] exponent: f64 = "Friction grows with this power of the speed: 1 for oil, less for grease.",
    }
    scaled by arcsec_per_deg_s;
    truth |self| [("trail", "rad/(rad/s)", self.arcsec_per_deg_s / 3600.0)];
    turns |self, at| {
        let speed = at.state.row.velocity.get(at.joint).copied().unwrap_or(0.0);
        let friction = KNOWN_AT * (speed.abs() / KNOWN_AT).powf(self.exponent) * speed.signum();
        if speed == 0.0 { 0.0 } else { -(self.arcsec_per_deg_s / 3600.0 * friction) }
    };
    fn moves_only(&self) -> bool {
        true
    }
}

fn one() -> f64 {
    1.0
}

/// rad/s: the speed at which every exponent gives the same.
const KNOWN_AT: f64 = 20.0 * std::f64::consts::PI / 180.0;

// Friction that keeps part of the last move's torque in the motor, so that the current at rest is not the load alone.
effect! {
    /// Coulomb friction on the motor's side; it changes what the controller logs, not where the arm stands.
    HoldingFriction "holding_friction" at joint {
        torque_nm: f64 = "Torque at the joint in the direction of the last move, Nm.",
    }
    scaled by torque_nm;
    truth |self| [("torque", "Nm", self.torque_nm)];
    fn act(&self, state: &State, motion: &mut Motion) {
        motion.motor_torque[self.joint - 1] += self.torque_nm * state.row.direction[self.joint - 1];
    }
}

/// How the pull depends on `u = q_joint + lead q_by + phase`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pull {
    /// `sin u`: a hose hung over both joints.
    Swing,
    /// `u^2 / 4`: a hose that is bent further the more both joints turn.
    Bend,
}

// How hard a hose package pulls depends on its joint and on another one, along which it is led.
effect! {
    /// Torque of a hose, or the turn by it where the joint's spring is not stated.
    CableDrag "cable_drag" at joint {
        by: usize = "The other joint, from 1.",
        lead: f64 = "Share of the other joint in the bend of the hose.",
        pull: Pull = "How it pulls.",
        #[serde(default)] amplitude_arcsec: f64 = "Turn of the joint by the pull, arcsec.",
        #[serde(default)] torque_nm: f64 = "Torque of the pull, Nm: the joint's spring and the motor feel it.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec torque_nm;
    truth |self| [("amplitude", "arcsec", self.amplitude_arcsec), ("torque", "Nm", self.torque_nm)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let joint = self.joint - 1;
        let u = state.row.command[joint] + self.lead * angle_of(state, self.by) + self.phase_deg.to_radians();
        let pull = match self.pull {
            Pull::Swing => u.sin(),
            Pull::Bend => 0.25 * u * u,
        };
        motion.joint[joint] += self.amplitude_arcsec * ARCSEC * pull;
        motion.load[joint] += self.torque_nm * pull;
    }
}

/// What makes the torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Balancer {
    /// `sin(q + phase)`: a coil spring on a crank, long against its stretch.
    Spring,
    /// `sin u / (1.25 - cos u)` with `u = q + phase`, times 0.75: a gas strut whose pressure rises as it is driven in.
    Gas,
}

// A balancer parallel to a joint's gear takes torque off the gear: who leaves it out overrates the wind-up.
effect! {
    /// Torque of a balancer.
    Counterbalance "counterbalance" at joint {
        balancer: Balancer = "What pushes.",
        torque_nm: f64 = "The largest torque on the joint, Nm; its sign is that of the turn.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by torque_nm;
    truth |self| [("torque", "Nm", self.torque_nm)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let (sine, cosine) = (state.row.command[self.joint - 1] + self.phase_deg.to_radians()).sin_cos();
        let course = match self.balancer {
            Balancer::Spring => sine,
            // sin u / (b - cos u) peaks at 1 / sqrt(b^2 - 1), 4/3 for b = 1.25.
            Balancer::Gas => 0.75 * sine / (1.25 - cosine),
        };
        motion.load[self.joint - 1] += self.torque_nm * course;
    }
}

// A collision, a slipped belt, a new mastering.
effect! {
    /// A step of a joint from a moment on.
    ZeroShift "zero_shift" at joint {
        step_arcsec: f64 = "arcsec.",
        at_s: f64 = "The moment since the start of the recording, s.",
    }
    scaled by step_arcsec;
    truth |self| [("step", "arcsec", self.step_arcsec), ("at", "s", self.at_s)];
    turns |self, at| if at.state.row.time_s >= self.at_s { self.step_arcsec * ARCSEC } else { 0.0 };
}

effect! {
    /// Tilt of the axis by `amplitude cos(order q + phase)` about one direction across it and `ellipse` times the sine about the other,
    /// seen from the body that carries the joint.
    AxisWobble "axis_wobble" at joint {
        order: f64 = "Periods per turn of the joint.",
        amplitude_arcsec: f64 = "arcsec.",
        #[serde(default)] ellipse: f64 = "Second half axis per first: 0 swings in one plane, 1 goes round.",
        #[serde(default)] phase_deg: f64 = "Phase at zero, deg.",
    }
    scaled by amplitude_arcsec;
    truth |self| [(format!("amplitude{}", self.order), "arcsec", self.amplitude_arcsec)];
    fn act(&self, state: &State, motion: &mut Motion) {
        let index = self.joint - 1;
        let axis = state.arm.links[index].axis;
        // The base direction that lies farthest from the axis makes the pair across it.
        let aside = if axis[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let first = matrix::cross(axis, aside);
        let first = matrix::scale(first, 1.0 / matrix::norm(first));
        let second = matrix::cross(axis, first);
        let (sine, cosine) = (self.order * state.row.command[index] + self.phase_deg.to_radians()).sin_cos();
        let size = self.amplitude_arcsec * ARCSEC;
        let tilt = matrix::add(matrix::scale(first, size * cosine), matrix::scale(second, size * self.ellipse * sine));
        motion.move_axis(state.arm.foot, index, &matrix::turn_by(tilt));
    }
}

/// Where the warmth `w` comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Heat {
    /// Travel of the joint that has not yet cooled off, rad.
    Work,
    /// The same of casing and oil, each with its time, half of each.
    Oil,
    /// The logged temperature over the reference, followed with the time constant, K.
    Temperature,
}

// A joint that is warm by its own work, which cools off, or by the arm's temperature, which it follows late.
effect! {
    /// The joint turns by `w (zero + ratio q + softening torque)`.
    JointWarming "joint_warming" at joint {
        heat: Heat = "What warms the joint.",
        #[serde(default)] time_s: f64 = "Time constant, s; of temperature 0: at once.",
        #[serde(default = "minute")] oil_s: f64 = "That of the oil, s.",
        #[serde(default)] full: f64 = "Warmth at which it saturates, as `full tanh(w / full)`; 0: it does not.",
        #[serde(default = "room")] reference_c: f64 = "Temperature at which nothing is off, C.",
        #[serde(default)] zero_arcsec: f64 = "arcsec per unit of warmth.",
        #[serde(default)] ratio_arcsec_per_rad: f64 = "arcsec per rad of the joint and unit of warmth.",
        #[serde(default)] softening_rad_per_nm: f64 = "rad/Nm per unit of warmth.",
    }
    scaled by zero_arcsec ratio_arcsec_per_rad softening_rad_per_nm;
    truth |self| {
        let kelvin = self.heat == Heat::Temperature;
        let [zero, ratio, softening] =
            if kelvin { ["arcsec/K", "arcsec/rad/K", "rad/Nm/K"] } else { ["arcsec/rad", "arcsec/rad2", "1/Nm"] };
        [
            ("zero", zero, self.zero_arcsec),
            ("ratio", ratio, self.ratio_arcsec_per_rad),
            ("softening", softening, self.softening_rad_per_nm),
            ("time", "s", self.time_s),
        ]
    };
    turns |self, at| {
        let zero = ARCSEC * (self.zero_arcsec + self.ratio_arcsec_per_rad * at.angle());
        at.state.memory * (zero + self.softening_rad_per_nm * at.torque())
    };
    fn remember(&self, past: &[Moment]) -> Vec<f64> {
        let worked = |time_s: f64| memory::recent_travel(past, self.joint, time_s);
        let warmth: Vec<f64> = match self.heat {
            Heat::Work => worked(self.time_s),
            Heat::Oil => worked(self.time_s).iter().zip(worked(self.oil_s)).map(|(casing, oil)| 0.5 * (casing + oil)).collect(),
            Heat::Temperature => {
                let joint = memory::behind(past, self.time_s, self.reference_c);
                joint.into_iter().map(|celsius| celsius - self.reference_c).collect()
            }
        };
        warmth.into_iter().map(|w| saturated(w, self.full)).collect()
    }
}

fn minute() -> f64 {
    60.0
}

fn room() -> f64 {
    20.0
}

// The next three are in no list that a diagnosis expects. A damaged tooth:
effect! {
    /// `amplitude exp(-((q - centre) / width)^2)`.
    JointBump "unknown" at joint ".bump" {
        amplitude_arcsec: f64 = "arcsec.",
        centre_deg: f64 = "Its middle, deg.",
        width_deg: f64 = "Its width, deg.",
    }
    scaled by amplitude_arcsec;
    truth |self| [("amplitude", "arcsec", self.amplitude_arcsec), ("centre", "deg", self.centre_deg), ("width", "deg", self.width_deg)];
    turns |self, at| {
        let away = (at.angle().to_degrees() - self.centre_deg) / self.width_deg;
        self.amplitude_arcsec * ARCSEC * (-away * away).exp()
    };
}

// A dress pack or a stop that begins to press:
effect! {
    /// Nothing below the angle, in proportion to what is beyond above it.
    JointHinge "unknown" at joint ".hinge" {
        from_deg: f64 = "Where it begins, deg.",
        arcsec_per_rad: f64 = "arcsec per rad beyond.",
    }
    scaled by arcsec_per_rad;
    truth |self| [("slope", "arcsec/rad", self.arcsec_per_rad), ("from", "deg", self.from_deg)];
    turns |self, at| self.arcsec_per_rad * ARCSEC * (at.angle() - self.from_deg.to_radians()).max(0.0);
}

effect! {
    /// `slope q_first q_second`, angles in rad.
    JointProduct "unknown" at joint ".product" {
        of: [usize; 2] = "The two joints that cause it, from 1.",
        arcsec_per_rad2: f64 = "arcsec per rad2.",
    }
    scaled by arcsec_per_rad2;
    truth |self| [("slope", "arcsec/rad2", self.arcsec_per_rad2)];
    turns |self, at| self.arcsec_per_rad2 * ARCSEC * angle_of(at.state, self.of[0]) * angle_of(at.state, self.of[1]);
}

// Joint positions logged before the arm has settled, or by a clock that is behind: the log holds part of the last move.
effect! {
    @type
    /// The log is behind: by a share of the last move, or by a time while the arm moves.
    JointLogLag {
        #[serde(default)] share: f64 = "Share of the last move that the log lacks.",
        #[serde(default)] clock_ms: f64 = "How much later than the joints a point is measured while the arm moves, ms.",
        #[serde(default)] joint: Option<usize> = "The joint whose log is behind, from 1; missing: all of them.",
    }
}

impl Act for JointLogLag {
    fn log(&self, q: &mut [f64], before: &[f64]) {
        for (joint, (now, then)) in q.iter_mut().zip(before).enumerate() {
            if self.joint.is_none_or(|only| only == joint + 1) {
                *now -= self.share * (*now - then);
            }
        }
    }
    fn later(&self) -> f64 {
        1e-3 * self.clock_ms
    }
}

impl Stated for JointLogLag {
    fn seat(&self) -> Option<usize> {
        self.joint
    }
    fn scale(&mut self, by: f64) {
        self.share *= by;
        self.clock_ms *= by;
    }
    fn truth(&self) -> Vec<TrueValue> {
        let share =
            (self.share != 0.0 || self.clock_ms == 0.0).then_some(("share", "1", self.share));
        let time = (self.clock_ms != 0.0).then(|| ("time", "s", self.later()));
        let numbers = share.into_iter().chain(time);
        true_values("joint_log_lag", "recording", "recording", numbers)
    }
}
