//! A case of a seed: which arm, which masses within their tolerance, which effects in which sizes and forms.

use super::law::Law;
use super::path::Path;
use super::rigid::{Body, Machine};
use crate::conceal::robots::Kind;
use crate::matrix::{self, Vector};
use crate::noise::{Noise, Purpose};
use calib_foundation::description::{DeclaredInertias, InertiaMoments, MassTolerance, RobotDescription};

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueDesign {
    /// The same seed gives the same recordings.
    pub seed: u64,
    /// Share of recordings without any effect.
    pub nulls: f64,
    /// Share of effects in a form that is not the usual formula.
    pub other_forms: f64,
    /// Effects beside viscous and Coulomb friction: at most so many.
    pub most: usize,
    /// Seconds of the recording: two stretches to fit, two that judge.
    pub seconds: f64,
    /// Rows a second.
    pub rate: f64,
}

/// A recording to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueCase {
    /// `torque_017`.
    pub name: String,
    /// Of this recording.
    pub seed: u64,
    /// The arm as its user believes it to be.
    pub robot: RobotDescription,
    /// What is concealed; joints from 0.
    pub(super) laws: Vec<Law>,
    /// Whether a law has another form than the usual formula.
    pub(super) other_form: Vec<bool>,
    pub(super) stated: Machine,
    pub(super) scattered: Machine,
    /// Hz of the rows.
    pub(super) rate: f64,
    pub(super) paths: Vec<Path>,
    /// Paths to fit; the others judge.
    pub(super) fitted: usize,
    /// Nm, by joint: white noise, and noise that lasts.
    pub(super) white: Vec<f64>,
    pub(super) lasting: Vec<f64>,
    /// Nm at the joint per unit of the signal.
    pub(super) per_unit: Vec<f64>,
    pub(super) resolution: f64,
    pub(super) encoder_deg: f64,
    /// Whether torques are measured at the joints; else motor currents.
    pub(super) sensors: bool,
}

/// Arms that torques are recorded of.
const ARMS: [Kind; 4] = [Kind::Sr210d, Kind::Compact6, Kind::Seven7r, Kind::Five5r];
/// Of the rated payload.
const CARRIED: [f64; 2] = [0.2, 0.6];
/// Shares of the recording of each stretch: sines and moves to fit, sines and moves that judge.
const STRETCHES: [f64; 4] = [0.3, 0.25, 0.25, 0.2];
const FITTED: usize = 2;
const TOLERANCE: MassTolerance = MassTolerance { mass: 0.01, centre: 0.004, inertia: 0.05 };
/// Standard deviations that the truth is off at most.
const MOST_OFF: f64 = 2.0;

impl TorqueCase {
    /// The case of this number.
    pub fn draw(design: &TorqueDesign, number: usize) -> Self {
        let seed = design.seed.wrapping_mul(1_000_003).wrapping_add(number as u64);
        let mut noise = Noise::new(seed, Purpose::Design);
        let kind = ARMS[noise.index(ARMS.len())];
        let robot = declared(kind, &mut noise);
        let stated = machine(&robot);
        let scattered = scattered(&stated, &mut noise);
        let speed = noise.uniform(0.8, 1.5) * if kind == Kind::Sr210d { 0.9 } else { 1.2 };
        let (paths, fitted) = paths(&robot, speed, design.seconds, &mut Noise::new(seed, Purpose::Poses));
        let sensors = kind == Kind::Seven7r;
        let n = robot.joints.len();
        let per_unit = robot.joints.iter().map(|joint| match sensors {
            true => 1.0,
            false => joint.reduction_ratio.unwrap_or(1.0) * joint.motor_constant.unwrap_or(1.0),
        });
        let mut case = Self {
            name: format!("torque_{number:03}"),
            seed,
            laws: Vec::new(),
            other_form: Vec::new(),
            stated,
            scattered,
            rate: design.rate,
            paths,
            fitted,
            white: vec![0.0; n],
            lasting: vec![0.0; n],
            per_unit: per_unit.collect(),
            resolution: if sensors { 0.01 } else { 0.002 },
            encoder_deg: if kind == Kind::Sr210d { 360.0 / f64::from(1 << 20) } else { 360.0 / f64::from(1 << 18) },
            sensors,
            robot,
        };
        let rows = case.rows(&[]);
        let peak = peaks(&rows.rigid, n);
        let most = peak.iter().copied().fold(0.0, f64::max);
        let level = noise.uniform(0.7, 1.4);
        case.white = peak.iter().map(|peak| level * (0.01 * peak + 0.001 * most)).collect();
        case.lasting = case.white.iter().map(|white| 0.27 * white).collect();
        if !noise.chance(design.nulls) {
            case.conceal(design, &peak, &mut noise);
        }
        case
    }

    fn conceal(&mut self, design: &TorqueDesign, peak: &[f64], noise: &mut Noise) {
        let n = peak.len();
        let speed = 1.0;
        let floor = peak.iter().copied().fold(0.0, f64::max) * 0.01;
        let scale: Vec<f64> = peak.iter().map(|peak| peak.max(floor)).collect();
        let width = noise.uniform(0.004, 0.012);
        if noise.chance(0.85) {
            for (joint, scale) in scale.iter().enumerate() {
                let other = noise.chance(design.other_forms * 0.3);
                let exponent = if other { noise.uniform(0.6, 0.8) } else { 1.0 };
                let size = scale * noise.uniform(0.04, 0.12) / speed;
                self.push(Law::Viscous { joint, size, exponent }, other);
                self.push(Law::Coulomb { joint, size: scale * noise.uniform(0.05, 0.15), width }, false);
            }
        }
        let plain = !self.laws.is_empty();
        let mut used: Vec<(usize, Option<usize>)> = Vec::new();
        for _ in 0..noise.index(design.most + 1).max(usize::from(!plain)) {
            let pool = Extra { width, plain, n, sensors: self.sensors, scale: &scale, machine: &self.stated };
            let other = noise.chance(design.other_forms);
            let (family, law) = pool.law(noise, other, &self.paths);
            let joint = law.joint();
            // One of a kind, and one modifier of friction a joint: two hide each other.
            if used.iter().any(|(known, at)| *known == family || (at.is_some() && *at == joint)) {
                continue;
            }
            used.push((family, joint));
            let has_another_form = other && law.has_other_form();
            self.push(law, has_another_form);
        }
    }

    fn push(&mut self, law: Law, other: bool) {
        self.laws.push(law);
        self.other_form.push(other);
    }
}

/// What effects are drawn with.
struct Extra<'a> {
    width: f64,
    /// Whether joints have friction that others modify.
    plain: bool,
    n: usize,
    sensors: bool,
    /// Nm, by joint.
    scale: &'a [f64],
    machine: &'a Machine,
}

const FAMILIES: usize = 22;

impl Extra<'_> {
    /// An effect of a family that this arm can have; `other` where it has another form, if there is one.
    fn law(&self, noise: &mut Noise, other: bool, paths: &[Path]) -> (usize, Law) {
        loop {
            let family = noise.index(FAMILIES);
            if let Some(law) = self.of_family(family, noise, other, paths) {
                return (family, law);
            }
        }
    }

    fn of_family(&self, family: usize, noise: &mut Noise, other: bool, paths: &[Path]) -> Option<Law> {
        let joint = noise.index(self.n);
        let scale = self.scale[joint];
        let width = self.width;
        let angle = |noise: &mut Noise| noise.uniform(-1.5, 1.5);
        if family < 5 && !self.plain {
            return None;
        }
        Some(match family {
            0 => Law::Asymmetric { joint, size: scale * noise.uniform(0.04, 0.1), width },
            1 => {
                let exponent = if other { 2.0 } else { 1.0 };
                Law::Stribeck { joint, size: scale * noise.uniform(0.08, 0.2), speed: noise.uniform(0.04, 0.12), exponent }
            }
            2 => {
                let (size, travel) = (scale * noise.uniform(0.08, 0.2), noise.size(0.004, 0.03));
                Law::Presliding { joint, size, travel, width, parallel: other }
            }
            3 => {
                let exponent: f64 = if other { noise.uniform(0.7, 0.9) } else { 1.0 };
                Law::Load { joint, share: noise.uniform(0.06, 0.2) * scale.powf(1.0 - exponent), exponent, width }
            }
            4 => Law::Warmup { joint, share: noise.uniform(0.4, 1.0), time: noise.uniform(6.0, 14.0) },
            5 => {
                let (joint, by) = (self.n - 1, self.n - 2);
                let scale = self.scale[joint].min(self.scale[by]);
                let (viscous, coulomb) = (scale * noise.uniform(0.1, 0.2), scale * noise.uniform(0.1, 0.2));
                Law::WristCoupling { joint, by, ratio: noise.sign(), viscous, coulomb, width }
            }
            6 => Law::Rotor { joint, inertia: scale * noise.uniform(0.03, 0.08) },
            7 => Law::TorqueConstant { joint, share: noise.sign() * noise.uniform(0.06, 0.15) },
            8 => Law::Offset { joint, size: noise.sign() * scale * noise.uniform(0.03, 0.1) },
            9 => {
                let order = (1 + noise.index(6)) as f64;
                Law::Ripple { joint, size: scale * noise.uniform(0.02, 0.06), order, phase: noise.uniform(0.0, 6.2) }
            }
            10 => Law::Spring { joint: 1, size: self.scale[1] * noise.uniform(0.1, 0.25), zero: angle(noise) },
            11 => {
                let hardening = if other { noise.uniform(0.2, 0.5) } else { 0.0 };
                Law::Cable { joint, stiffness: scale * noise.uniform(0.04, 0.12), zero: angle(noise), hardening }
            }
            12 => Law::Latency { time: noise.uniform(0.006, 0.02) },
            13 => {
                let (frequency, damping) = (noise.uniform(18.0, 35.0), noise.uniform(0.05, 0.2));
                Law::Elasticity { joint, frequency, damping }
            }
            14 => Law::Backlash { joint, size: scale * noise.uniform(0.06, 0.15), time: noise.uniform(0.03, 0.08) },
            15 => {
                let start = noise.uniform(2.0, paths[0].duration - 4.0);
                let reach = matrix::norm(matrix::minus(self.machine.tool, self.machine.points[0])).max(0.3);
                let most = self.scale.iter().copied().fold(0.0, f64::max);
                let size = 0.1 * most / reach;
                Law::Contact { start, end: start + noise.uniform(0.8, 1.6), force: noise.vector(size, 3.0 * size) }
            }
            16 => {
                let payload = self.machine.payload.map_or(0.0, |payload| payload.mass);
                let centre = if other { noise.vector(0.01, 0.03) } else { [0.0; 3] };
                Law::Payload { mass: noise.sign() * payload * noise.uniform(0.1, 0.3), centre }
            }
            17 => Law::LinkMass { link: 1 + noise.index(self.n - 2), share: noise.sign() * noise.uniform(0.06, 0.15) },
            18 => Law::LinkCentre { link: 1 + noise.index(self.n - 2), shift: noise.vector(0.02, 0.05) },
            19 => Law::LinkInertia { link: noise.index(self.n - 1), share: noise.uniform(0.4, 1.0) },
            20 => {
                let [x, y, _] = noise.vector(0.02, 0.05);
                Law::Tilt { by: [x, y] }
            }
            _ if other => {
                let by = (joint + 1 + noise.index(self.n - 1)) % self.n;
                Law::Meshing { joint, by, size: scale * noise.uniform(0.06, 0.15), order: (2 + noise.index(2)) as f64 }
            }
            _ => return None,
        })
        .filter(|law| !(self.sensors && matches!(law, Law::TorqueConstant { .. } | Law::Rotor { .. })))
    }
}

/// The arm with a payload, inertias and tolerances declared.
fn declared(kind: Kind, noise: &mut Noise) -> RobotDescription {
    let mut robot = kind.description([0.0; 3]);
    robot.payload_mass = (robot.payload_mass * noise.uniform(CARRIED[0], CARRIED[1]) * 10.0).round() / 10.0;
    let ends = robot.joints.iter().skip(1).map(|joint| joint.point).chain([robot.tool]).collect::<Vec<_>>();
    let links = robot.joints.iter().zip(ends).map(|(joint, end)| {
        let span = matrix::minus(end, joint.point);
        Some(rod(joint.mass.unwrap_or(0.0), span))
    });
    let links = links.collect();
    let across = 0.2 * matrix::norm(matrix::minus(robot.payload_centre, robot.tool)) + 0.1;
    let ball = 0.4 * robot.payload_mass * across * across;
    robot.inertias = DeclaredInertias { links, payload: Some([ball, 0.0, 0.0, ball, 0.0, ball]), tolerance: Some(TOLERANCE) };
    robot
}

/// Moments of a thick rod along `span`.
fn rod(mass: f64, span: Vector) -> InertiaMoments {
    let length = matrix::norm(span).max(0.08);
    let along = matrix::scale(span, 1.0 / matrix::norm(span).max(1e-9));
    let radius = 0.18 * length + 0.03;
    let (axial, lateral) = (0.5 * mass * radius * radius, mass * (length * length / 12.0 + 0.25 * radius * radius));
    let moment = |i: usize, j: usize| f64::from(i == j) * lateral + (axial - lateral) * along[i] * along[j];
    [moment(0, 0), moment(0, 1), moment(0, 2), moment(1, 1), moment(1, 2), moment(2, 2)]
}

/// The bodies that a description declares.
fn machine(robot: &RobotDescription) -> Machine {
    let body = |(joint, moments): (&calib_foundation::description::JointDescription, &Option<InertiaMoments>)| Body {
        mass: joint.mass.unwrap_or(0.0),
        centre: joint.centre.unwrap_or(joint.point),
        inertia: moments.unwrap_or_default(),
    };
    Machine {
        axes: robot.joints.iter().map(|joint| joint.axis).collect(),
        points: robot.joints.iter().map(|joint| joint.point).collect(),
        tool: robot.tool,
        links: robot.joints.iter().zip(&robot.inertias.links).map(body).collect(),
        payload: (robot.payload_mass > 0.0).then(|| Body {
            mass: robot.payload_mass,
            centre: robot.payload_centre,
            inertia: robot.inertias.payload.unwrap_or_default(),
        }),
        gravity: robot.gravity,
    }
}

/// The bodies as they are, off within the tolerance; the payload is as declared.
fn scattered(stated: &Machine, noise: &mut Noise) -> Machine {
    let mut off = |sigma: f64| sigma * noise.normal().clamp(-MOST_OFF, MOST_OFF);
    let mut machine = stated.clone();
    for body in &mut machine.links {
        body.mass *= 1.0 + off(TOLERANCE.mass);
        body.centre = body.centre.map(|x| x + off(TOLERANCE.centre));
        let share = 1.0 + off(TOLERANCE.inertia);
        body.inertia = body.inertia.map(|moment| moment * share);
    }
    machine
}

/// Sines to fit, moves to fit, sines and moves that judge.
pub(super) fn paths(robot: &RobotDescription, speed: f64, seconds: f64, noise: &mut Noise) -> (Vec<Path>, usize) {
    let ranges: Vec<[f64; 2]> = robot
        .joints
        .iter()
        .map(|joint| {
            let [lower, upper] = joint.limits.unwrap_or([-1.5, 1.5]);
            let (middle, reach) = (0.5 * (lower + upper), (0.3 * (upper - lower)).min(1.2));
            [middle - reach, middle + reach]
        })
        .collect();
    let paths = STRETCHES.iter().enumerate().map(|(k, share)| match k % 2 {
        0 => Path::sines(noise, &ranges, speed, share * seconds),
        _ => Path::moves(noise, &ranges, speed, share * seconds),
    });
    (paths.collect(), FITTED)
}

/// Largest rigid torque of each joint, Nm.
fn peaks(rigid: &[f64], joints: usize) -> Vec<f64> {
    let of_joint = |joint: usize| rigid.iter().skip(joint).step_by(joints).fold(0.0, |most: f64, x| most.max(x.abs()));
    (0..joints).map(of_joint).collect()
}
