//! A case of a seed: which arm, which inertials within their tolerance, which effects in which sizes, along which commands.

use super::law::{DRAWS, Law};
use super::motion;
use super::rig::{Rig, Servo};
use crate::conceal::design::Design;
use crate::matrix::Vector;
use crate::noise::{Noise, Purpose};
use crate::torque::{Body, Machine};
use std::f64::consts::{PI, TAU};

/// A recording to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveCase {
    /// `drives_017`.
    pub name: String,
    pub(super) seed: u64,
    pub(super) kind: &'static str,
    pub(super) content: &'static str,
    /// As its user believes it to be, and as it is but for what is concealed.
    pub(super) stated: Rig,
    pub(super) scattered: Rig,
    pub(super) laws: Vec<Law>,
    /// s between two commands.
    pub(super) period: f64,
    /// Row-major; trajectories follow each other.
    pub(super) commands: Vec<f64>,
    /// Rows of each trajectory; the last one judges.
    pub(super) lengths: Vec<usize>,
    /// rad: step of the encoders, standard deviation of the white noise.
    pub(super) encoder: f64,
    pub(super) noise: f64,
}

/// Standard deviations of what is declared: mass, centre (m), inertia.
pub(super) const TOLERANCE: [f64; 3] = [0.02, 0.003, 0.1];
/// Standard deviations that the truth is off at most.
const MOST_OFF: f64 = 2.0;
/// s of the trajectories to fit, and of the one that judges.
const LASTS: [f64; 3] = [8.0, 7.0, 6.0];
/// s of rest at either end of a trajectory, and in which it comes up.
const REST: f64 = 0.6;
const RAMP: f64 = 0.8;
/// Laws that are listed: all but the last.
const LAWS: usize = DRAWS.len() - 1;

/// What arms of a kind have: rows are joints.
struct Plan {
    name: &'static str,
    axes: &'static [Vector],
    points: &'static [Vector],
    tool: Vector,
    masses: &'static [f64],
    home: &'static [f64],
    /// rad around home.
    reach: f64,
    /// Nm/rad, Nm s/rad, Nm.
    drive: [f64; 3],
    on_error: bool,
    /// Nm s/rad, Nm, kg m2.
    joint: [f64; 3],
    rate: f64,
    encoder: f64,
    noise: f64,
}

const X: Vector = [1.0, 0.0, 0.0];
const Y: Vector = [0.0, 1.0, 0.0];
const Z: Vector = [0.0, 0.0, 1.0];

const PLANS: [Plan; 3] = [
    Plan {
        name: "leg",
        axes: &[X, Y, Y],
        points: &[[0.0; 3], [0.0, 0.09, 0.0], [0.0, 0.09, -0.21]],
        tool: [0.0, 0.09, -0.42],
        masses: &[0.7, 1.1, 0.3],
        home: &[0.0, 0.7, -1.4],
        reach: 0.35,
        drive: [30.0, 1.2, 24.0],
        on_error: false,
        joint: [0.3, 0.2, 0.012],
        rate: 200.0,
        encoder: 2e-4,
        noise: 1.5e-4,
    },
    Plan {
        name: "desk",
        axes: &[Z, Y, Y, Y],
        points: &[
            [0.0; 3],
            [0.0, 0.0, 0.06],
            [0.11, 0.0, 0.08],
            [0.24, 0.0, 0.08],
        ],
        tool: [0.33, 0.0, 0.08],
        masses: &[0.15, 0.14, 0.12, 0.12],
        home: &[0.0, -0.4, 0.7, 0.3],
        reach: 0.5,
        drive: [16.0, 0.6, 3.0],
        on_error: false,
        joint: [0.15, 0.06, 0.02],
        rate: 50.0,
        encoder: 1.5e-3,
        noise: 1e-3,
    },
    Plan {
        name: "cobot",
        axes: &[Z, Y, Y, X],
        points: &[
            [0.0; 3],
            [0.0, 0.0, 0.15],
            [0.35, 0.0, 0.15],
            [0.6, 0.0, 0.15],
        ],
        tool: [0.75, 0.0, 0.15],
        masses: &[3.0, 3.5, 2.0, 1.2],
        home: &[0.0, -0.5, 0.9, 0.2],
        reach: 0.5,
        drive: [900.0, 50.0, 120.0],
        on_error: true,
        joint: [3.0, 2.0, 0.5],
        rate: 125.0,
        encoder: 5e-5,
        noise: 4e-5,
    },
];

impl Plan {
    fn rig(&self, draw: &mut Noise) -> Rig {
        let n = self.axes.len();
        let end = |j: usize| {
            if j + 1 < n {
                self.points[j + 1]
            } else {
                self.tool
            }
        };
        let links = (0..n).map(|j| {
            let (from, to) = (self.points[j], end(j));
            let share = draw.uniform(0.35, 0.6);
            let mass = self.masses[j] * draw.uniform(0.7, 1.4);
            let span: f64 = from.iter().zip(&to).map(|(a, b)| (b - a).powi(2)).sum();
            let size = mass * (span / 12.0 + 4e-4 + 0.02 * span);
            Body {
                mass,
                centre: std::array::from_fn(|k| from[k] + share * (to[k] - from[k])),
                inertia: [size, 0.0, 0.0, size, 0.0, size],
            }
        });
        let links: Vec<Body> = links.collect();
        let weaker = |j: usize| 1.0 - 0.5 * j as f64 / n as f64;
        let servos = (0..n).map(|j| {
            let mut by = |x: f64| x * weaker(j) * draw.uniform(0.75, 1.3);
            let drive = self.drive.map(&mut by);
            Servo::plain(drive, self.on_error, self.joint.map(&mut by))
        });
        Rig {
            hold: 0.0,
            sag: 0.0,
            servos: servos.collect(),
            machine: Machine {
                axes: self.axes.to_vec(),
                points: self.points.to_vec(),
                tool: self.tool,
                links,
                payload: None,
                gravity: [0.0, 0.0, -9.81],
            },
        }
    }

    /// Commands of the trajectories, each from home to home, and their rows.
    fn commands(&self, draw: &mut Noise) -> (Vec<f64>, Vec<usize>) {
        let (n, period) = (self.axes.len(), 1.0 / self.rate);
        let (mut all, mut lengths) = (Vec::new(), Vec::new());
        for (kind, lasts) in LASTS.into_iter().enumerate() {
            let rows = (lasts * self.rate) as usize;
            let time = |row: usize| row as f64 * period;
            let gate = |t: f64| {
                let near = (t - REST).min(lasts - REST - t) / RAMP;
                let u = near.clamp(0.0, 1.0);
                u * u * (3.0 - 2.0 * u)
            };
            let mut ways: Vec<Vec<f64>> = Vec::new();
            for _ in 0..n {
                let way: Vec<f64> = match kind {
                    1 => steps(rows, period, lasts, draw),
                    _ => {
                        let fast = if kind == 0 { 1.8 } else { 2.4 };
                        let waves: [[f64; 3]; 4] = std::array::from_fn(|_| {
                            [
                                draw.uniform(0.1, fast),
                                draw.uniform(0.0, TAU),
                                draw.uniform(0.3, 1.0),
                            ]
                        });
                        let whole: f64 = waves.iter().map(|wave| wave[2]).sum();
                        let at = |t: f64| {
                            waves
                                .iter()
                                .map(|[f, p, a]| a * (TAU * f * (t - REST) + p).sin())
                                .sum::<f64>()
                        };
                        (0..rows)
                            .map(|row| 1.5 * gate(time(row)) * at(time(row)) / whole)
                            .collect()
                    }
                };
                ways.push(way);
            }
            let of_row = |row: usize| {
                let joints = ways.iter().zip(self.home);
                let angles = joints.map(|(way, home)| home + self.reach * way[row]);
                angles.collect::<Vec<f64>>()
            };
            all.extend((0..rows).flat_map(of_row));
            lengths.push(rows);
        }
        (all, lengths)
    }
}

/// From point to point by half cosines with rests, from 0 and to 0.
fn steps(rows: usize, period: f64, lasts: f64, draw: &mut Noise) -> Vec<f64> {
    let mut out = vec![0.0; rows];
    let (mut at, mut from) = (0.0, REST);
    while from < lasts - REST - 0.5 {
        let moves = draw.uniform(0.4, 0.9);
        let last = from + moves + 1.2 > lasts - REST;
        let to = if last { 0.0 } else { draw.uniform(-1.0, 1.0) };
        for (row, value) in out.iter_mut().enumerate() {
            let since = row as f64 * period - from;
            if since >= 0.0 {
                let share = (since / moves).min(1.0);
                *value = at + (to - at) * 0.5 * (1.0 - (PI * share).cos());
            }
        }
        if last {
            break;
        }
        at = to;
        from += moves + draw.uniform(0.2, 0.5);
    }
    out
}

impl DriveCase {
    /// The case of this number.
    pub fn draw(design: &Design, number: usize) -> Self {
        let seed = design.seed_of(number);
        let mut draw = Noise::new(seed, Purpose::Design);
        let plan = &PLANS[draw.index(PLANS.len())];
        let stated = plan.rig(&mut draw);
        let mut scattered = stated.clone();
        if draw.chance(0.5) {
            for link in 0..stated.joints() {
                let mut off = |sigma: f64| sigma * draw.normal().clamp(-MOST_OFF, MOST_OFF);
                let [mass, centre, inertia] = TOLERANCE;
                for number in 0..5 {
                    let sigma = [mass, centre, centre, centre, inertia][number];
                    scattered = scattered.off(link, number, off(sigma));
                }
            }
        }
        let (commands, lengths) = plan.commands(&mut Noise::new(seed, Purpose::Poses));
        let content = design.moving_content(number);
        let mut case = Self {
            name: format!("drives_{number:03}"),
            seed,
            kind: plan.name,
            content,
            stated,
            scattered,
            laws: Vec::new(),
            period: 1.0 / plan.rate,
            commands,
            lengths,
            encoder: plan.encoder,
            noise: plan.noise,
        };
        let wanted = match content {
            "null" => 0,
            "pair" => 2,
            _ => 1,
        };
        while case.laws.len() < wanted {
            let which = match content {
                "open" => LAWS,
                _ if case.laws.is_empty() => number % LAWS,
                _ => draw.index(LAWS),
            };
            let law = case.law(which, &mut draw);
            if case
                .laws
                .iter()
                .all(|one| one.place() != law.place() && one.name() != law.name())
            {
                case.laws.push(law);
            }
        }
        case
    }

    /// A law by its number, of a size that drives have.
    fn law(&self, which: usize, draw: &mut Noise) -> Law {
        let joint = draw.index(self.stated.joints());
        let site = Site {
            case: self,
            joint,
            usual: self.usual(joint),
            servo: &self.stated.servos[joint],
        };
        DRAWS[which](&site, draw)
    }

    pub(super) fn usual(&self, joint: usize) -> Usual {
        let n = self.stated.joints();
        let angles = motion::angles(&self.stated, &self.commands, self.period, motion::COARSE);
        let servo = &self.stated.servos[joint];
        let mut usual = Usual {
            range: [f64::MAX, f64::MIN],
            ..Usual::default()
        };
        for row in 1..angles.len() / n {
            let at = row * n + joint;
            let (angle, error) = (angles[at], self.commands[at] - angles[at]);
            usual.error = usual.error.max(error.abs());
            usual.torque = usual.torque.max((servo.kp * error).abs().min(servo.limit));
            usual.speed = usual
                .speed
                .max((angle - angles[at - n]).abs() / self.period);
            usual.rate = usual
                .rate
                .max((self.commands[at] - self.commands[at - n]).abs() / self.period);
            usual.range = [usual.range[0].min(angle), usual.range[1].max(angle)];
        }
        usual
    }
}

/// Largest values of the arm as it is believed to be.
#[derive(Default)]
pub(super) struct Usual {
    pub(super) torque: f64,
    pub(super) error: f64,
    pub(super) speed: f64,
    pub(super) rate: f64,
    pub(super) range: [f64; 2],
}

/// A joint that a law is drawn for.
pub(super) struct Site<'a> {
    pub(super) case: &'a DriveCase,
    pub(super) joint: usize,
    pub(super) usual: Usual,
    pub(super) servo: &'a Servo,
}
