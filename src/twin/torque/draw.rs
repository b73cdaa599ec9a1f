//! A case of a seed: which arm, which masses within their tolerance, which effects in which sizes and forms.

use super::family::{OPEN, Pool, TORQUES};
use super::law::Law;
use crate::conceal::design::Design;
use crate::conceal::robots::{ALL_KINDS, Kind};
use crate::matrix::{self, Vector};
use crate::noise::{Noise, Purpose};
use crate::torque::law::{Body, Machine};
use crate::way::{Path, moves, sines};
use calib_foundation::description::{
    DeclaredInertias, InertiaMoments, JointDescription, MassTolerance, RobotDescription,
};

impl Design {
    /// What the recording of this number conceals, the friction of all joints apart: `null`, `single`, `pair`, or `open` for one effect that is
    /// in no list. Shares are kept by multiples of the golden ratio, whose order says nothing.
    pub(crate) fn moving_content(&self, number: usize) -> &'static str {
        let begin = Noise::new(self.seed, Purpose::Design).uniform(0.0, 1.0);
        let at = (begin + number as f64 * 0.618_033_988_749_895).fract();
        let shares = [
            ("null", self.nulls),
            ("pair", self.pairs),
            ("open", self.open),
        ];
        let mut end = 0.0;
        let mut within = |(_, share): &(&str, f64)| {
            end += share;
            at < end
        };
        let content = shares.into_iter().find(&mut within);
        content.map_or("single", |(content, _)| content)
    }

    /// Families in an order of the seed: in turn, all are drawn.
    fn torque_family(&self, number: usize) -> usize {
        let mut draw = Noise::new(self.seed, Purpose::Faults);
        let mut order: Vec<usize> = (0..LISTED).collect();
        draw.shuffle(&mut order);
        order[number % LISTED]
    }
}

/// Families that are in the list.
const LISTED: usize = TORQUES.len() - OPEN;

/// A recording to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueCase {
    /// `torque_017`.
    pub name: String,
    pub(crate) seed: u64,
    /// The arm as its user believes it to be.
    pub robot: RobotDescription,
    pub(super) content: &'static str,
    /// What is concealed, friction of all joints first; joints from 0.
    pub(super) laws: Vec<Law>,
    /// How many laws are friction of all joints.
    pub(super) common: usize,
    pub(super) stated: Machine,
    pub(super) scattered: Machine,
    /// Hz of the rows.
    pub(super) rate: f64,
    /// How long each lasts, s, and the way.
    pub(super) paths: Vec<(f64, Path)>,
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

/// Payload that is carried, least and most, as a share of the rated one.
const CARRIED: [f64; 2] = [0.2, 0.6];
/// Shares of the recording of each stretch: sines and moves to fit, sines and moves that judge.
const STRETCHES: [f64; 4] = [0.3, 0.25, 0.25, 0.2];
pub(super) const FITTED: usize = 2;
const TOLERANCE: MassTolerance = MassTolerance {
    mass: 0.01,
    centre: 0.004,
    inertia: 0.05,
};
/// Standard deviations that the truth is off at most.
const MOST_OFF: f64 = 2.0;

impl TorqueCase {
    /// The case of this number.
    pub fn draw(design: &Design, number: usize) -> Self {
        let seed = design.seed.wrapping_mul(1_000_003);
        let seed = seed.wrapping_add(number as u64);
        let mut noise = Noise::new(seed, Purpose::Design);
        let kind = ALL_KINDS[noise.index(ALL_KINDS.len())];
        let robot = declared(kind, &mut noise);
        let stated = machine(&robot);
        let scattered = scattered(&stated, &mut noise);
        let speed = noise.uniform(0.8, 1.5) * if kind == Kind::Sr210d { 0.9 } else { 1.2 };
        let mut way = Noise::new(seed, Purpose::Poses);
        let paths = paths(&robot, speed, design.seconds, &mut way);
        let sensors = kind == Kind::Seven7r;
        let n = robot.joints.len();
        let per_unit = robot.joints.iter().map(|joint| match sensors {
            true => 1.0,
            false => joint.reduction_ratio.unwrap_or(1.0) * joint.motor_constant.unwrap_or(1.0),
        });
        let mut case = Self {
            name: format!("torque_{number:03}"),
            seed,
            content: design.moving_content(number),
            laws: Vec::new(),
            common: 0,
            stated,
            scattered,
            rate: design.rate,
            paths,
            fitted: FITTED,
            white: vec![0.0; n],
            lasting: vec![0.0; n],
            per_unit: per_unit.collect(),
            resolution: if sensors { 0.01 } else { 0.002 },
            encoder_deg: 360.0 / f64::from(1 << if kind == Kind::Sr210d { 20 } else { 18 }),
            sensors,
            robot,
        };
        let rows = case.rows(&[]);
        let peak = peaks(&rows.rigid, n);
        let most = peak.iter().copied().fold(0.0, f64::max);
        let level = noise.uniform(0.7, 1.4);
        let white = |peak: &f64| level * (0.01 * peak + 0.001 * most);
        case.white = peak.iter().map(white).collect();
        case.lasting = case.white.iter().map(|white| 0.27 * white).collect();
        case.conceal(design, number, &peak, &mut noise);
        case
    }

    fn conceal(&mut self, design: &Design, number: usize, peak: &[f64], noise: &mut Noise) {
        let floor = peak.iter().copied().fold(0.0, f64::max) * 0.01;
        let scale: Vec<f64> = peak.iter().map(|peak| peak.max(floor)).collect();
        let width = noise.uniform(0.004, 0.012);
        if noise.chance(if self.content == "null" { 0.5 } else { COMMON }) {
            for (joint, scale) in scale.iter().enumerate() {
                let other = noise.chance(design.other_forms * 0.3);
                let exponent = if other { noise.uniform(0.6, 0.8) } else { 1.0 };
                let viscous = scale * noise.uniform(0.04, 0.12);
                self.laws.push(Law::viscous(joint, viscous, exponent));
                let coulomb = scale * noise.uniform(0.05, 0.15);
                self.laws.push(Law::coulomb(joint, coulomb, width));
            }
        }
        self.common = self.laws.len();
        let wanted = match self.content {
            "null" => 0,
            "pair" => 2,
            _ => 1,
        };
        let mut drawn: Vec<(usize, Law)> = Vec::new();
        let mut family = match self.content {
            "open" => LISTED + noise.index(OPEN),
            _ => design.torque_family(number),
        };
        while drawn.len() < wanted {
            let other = noise.chance(design.other_forms);
            let pool = Pool {
                joint: noise.index(scale.len()),
                width,
                common: self.common > 0,
                sensors: self.sensors,
                scale: &scale,
                machine: &self.stated,
                touched: self.paths[0].0,
            };
            let law = (TORQUES[family].draw)(&pool, other, noise);
            // One of a kind, and one a joint: two hide each other.
            let apart = |law: &Law| {
                drawn.iter().all(|(known, one)| {
                    *known != family && (one.joint().is_none() || one.joint() != law.joint())
                })
            };
            drawn.extend(law.filter(apart).map(|law| (family, law)));
            family = noise.index(LISTED);
        }
        self.laws.extend(drawn.into_iter().map(|(_, law)| law));
    }
}

/// Share of recordings in which all joints have friction.
const COMMON: f64 = 0.85;

/// The arm with a payload, inertias and tolerances declared.
fn declared(kind: Kind, noise: &mut Noise) -> RobotDescription {
    let mut robot = kind.description([0.0; 3]);
    robot.payload_mass =
        (robot.payload_mass * noise.uniform(CARRIED[0], CARRIED[1]) * 10.0).round() / 10.0;
    let ends = robot.joints.iter().skip(1).map(|joint| joint.point);
    let ends = ends.chain([robot.tool]);
    let links = robot.joints.iter().zip(ends).map(|(joint, end)| {
        let span = matrix::minus(end, joint.point);
        Some(rod(joint.mass.unwrap_or(0.0), span))
    });
    let links = links.collect();
    let across = 0.2 * matrix::norm(matrix::minus(robot.payload_centre, robot.tool)) + 0.1;
    let ball = 0.4 * robot.payload_mass * across * across;
    robot.inertias = DeclaredInertias {
        links,
        payload: Some([ball, 0.0, 0.0, ball, 0.0, ball]),
        tolerance: Some(TOLERANCE),
    };
    robot
}

/// Moments of a thick rod along `span`.
fn rod(mass: f64, span: Vector) -> InertiaMoments {
    let length = matrix::norm(span).max(0.08);
    let along = matrix::scale(span, 1.0 / matrix::norm(span).max(1e-9));
    let radius = 0.18 * length + 0.03;
    let axial = 0.5 * mass * radius * radius;
    let lateral = mass * (length * length / 12.0 + 0.25 * radius * radius);
    [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
        .map(|(i, j)| f64::from(i == j) * lateral + (axial - lateral) * along[i] * along[j])
}

/// The bodies that a description declares.
fn machine(robot: &RobotDescription) -> Machine {
    let joints = robot.joints.iter().zip(&robot.inertias.links);
    let links = joints.map(|(joint, moments)| Body {
        mass: joint.mass.unwrap_or(0.0),
        centre: joint.centre.unwrap_or(joint.point),
        inertia: moments.unwrap_or_default(),
    });
    Machine {
        axes: robot.joints.iter().map(|joint| joint.axis).collect(),
        points: robot.joints.iter().map(|joint| joint.point).collect(),
        tool: robot.tool,
        links: links.collect(),
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
pub(super) fn paths(
    robot: &RobotDescription,
    speed: f64,
    seconds: f64,
    noise: &mut Noise,
) -> Vec<(f64, Path)> {
    let range = |joint: &JointDescription| {
        let [lower, upper] = joint.limits.unwrap_or([-1.5, 1.5]);
        let (middle, reach) = (0.5 * (lower + upper), (0.3 * (upper - lower)).min(1.2));
        [middle - reach, middle + reach]
    };
    let ranges: Vec<[f64; 2]> = robot.joints.iter().map(range).collect();
    let paths = STRETCHES.iter().enumerate().map(|(k, share)| {
        let draw = if k % 2 == 0 { sines } else { moves };
        let duration = share * seconds;
        (duration, draw(noise, &ranges, speed, duration))
    });
    paths.collect()
}

/// Largest rigid torque of each joint, Nm.
fn peaks(rigid: &[f64], joints: usize) -> Vec<f64> {
    let mut peaks = vec![0.0; joints];
    for (k, torque) in rigid.iter().enumerate() {
        peaks[k % joints] = torque.abs().max(peaks[k % joints]);
    }
    peaks
}
