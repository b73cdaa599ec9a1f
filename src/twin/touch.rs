//! Recordings without an instrument: the ball on the tool is brought to sockets, planes and spheres that stand about the robot, and
//! nothing but the joints is written down.

use super::matrix::{self, Vector};
use super::noise::{Noise, Purpose};
use super::plan::{self, Climate, Poses};
use super::recorder::settle;
use super::recorder::{Experiment, Scene};
use crate::arm::{Motion, Row};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the ball is brought to, base frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fixture {
    /// Kind of thing.
    pub kind: FixtureKind,
    /// Its name in the recording.
    pub name: String,
    /// Its centre; of a plane the middle of where it is touched, mm.
    pub centre_mm: Vector,
    /// A vector along the normal of a plane.
    #[serde(default)]
    pub normal: Option<Vector>,
    /// Radius of a sphere together with the ball's; for a plane that of the disc in which it is touched, mm.
    #[serde(default)]
    pub radius_mm: Option<f64>,
    /// How often the ball is brought there.
    pub points: usize,
    /// Standard deviation with which it comes back, per axis or along the normal, um.
    pub sigma_um: f64,
    /// What the rows are for: the column `usage`.
    #[serde(default = "fit")]
    pub usage: String,
}

fn fit() -> String {
    "fit".into()
}

/// Kinds of things.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum FixtureKind {
    /// The ball lies in it.
    Socket,
    /// The ball touches it.
    Plane,
    /// The ball touches it.
    Sphere,
}

/// A row of joints at which the ball is where it was brought to.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    /// Number of the fixture, from 0.
    pub fixture: usize,
    /// Reported joint positions, rad or m.
    pub q: Vec<f64>,
    pub time_s: f64,
    pub temperature_c: f64,
}

/// Random postures that Newton's steps start from before a point is given up.
const TRIES: usize = 3000;
/// Steps from one of them.
const STEPS: usize = 30;
/// m; the ball is there.
const THERE: f64 = 1e-10;
/// Step of differences, rad or m.
const STEP: f64 = 1e-6;
/// A step turns no joint farther, rad or m.
const FAR: f64 = 0.4;

impl Fixture {
    /// What is wrong with it: the place below it, and the message.
    pub fn faults(&self) -> Vec<(&'static str, &'static str)> {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let plain = |part: &str| !part.is_empty() && part.chars().all(is_word);
        let normal = self.normal.is_some_and(|normal| matrix::norm(normal) > 0.0);
        let radius = self.radius_mm.is_some_and(|radius| radius > 0.0);
        let rules = [
            (
                self.name.split('/').all(plain),
                "name",
                "expected letters, digits, - and _, in parts with / between, e.g. front/0",
            ),
            (self.points > 0, "points", "expected 1 or more"),
            (
                self.sigma_um >= 0.0 && self.sigma_um.is_finite(),
                "sigma_um",
                "expected 0 or more",
            ),
            (
                (self.kind == FixtureKind::Plane) == normal,
                "normal",
                "a plane has one, e.g. [0, 0, 1], and nothing else has",
            ),
            (
                (self.kind != FixtureKind::Socket) == radius,
                "radius_mm",
                "planes and spheres have one above 0, sockets none",
            ),
        ];
        plan::broken(rules)
    }

    /// A point at which the ball may lie, m: drawn over what is touched, with the noise of coming back.
    fn point(&self, draw: &mut Noise, noise: &mut Noise) -> Vector {
        let (centre, sigma) = (matrix::scale(self.centre_mm, 1e-3), 1e-6 * self.sigma_um);
        let radius = 1e-3 * self.radius_mm.unwrap_or(0.0);
        match self.kind {
            FixtureKind::Socket => centre.map(|coordinate| coordinate + sigma * noise.normal()),
            FixtureKind::Sphere => {
                let along = draw.vector(1.0, 1.0);
                let out = matrix::scale(along, radius + sigma * noise.normal());
                matrix::add(centre, out)
            }
            FixtureKind::Plane => {
                let normal = self.normal.unwrap_or([0.0, 0.0, 1.0]);
                let normal = matrix::scale(normal, 1.0 / matrix::norm(normal));
                let flat = matrix::cross(normal, draw.vector(1.0, 1.0));
                let far = radius * draw.uniform(0.0, 1.0).sqrt();
                let out = matrix::scale(flat, far / matrix::norm(flat).max(1e-9));
                let off = matrix::scale(normal, sigma * noise.normal());
                matrix::add(matrix::add(centre, out), off)
            }
        }
    }
}

impl Experiment<'_> {
    /// Brings the ball to every fixture in turn, as often as it says. Fails with the name of what cannot be reached.
    pub fn touch(&self, fixtures: &[Fixture]) -> Result<Vec<Touch>, String> {
        let scene = self.scene();
        let ranges = plan::ranges(self.robot, self.poses)?;
        let mut draw = Noise::new(self.seed, Purpose::Poses);
        let mut noise = Noise::new(self.seed, Purpose::Tracker);
        let mut clock = Noise::new(self.seed, Purpose::Clock);
        let Climate {
            pace_s, begin_s, ..
        } = *self.climate;
        let (mut time_s, mut touches) = (begin_s, Vec::new());
        for (number, fixture) in fixtures.iter().enumerate() {
            for _ in 0..fixture.points {
                time_s += clock.uniform(pace_s[0], pace_s[1]);
                let temperature_c = self.climate.temperature(time_s);
                let there = fixture.point(&mut draw, &mut noise);
                let before = touches.last().map(|touch: &Touch| touch.q.clone());
                let (there, at) = ((there, before.as_deref()), [time_s, temperature_c]);
                let q = self.reach(&scene, &ranges, there, at, &mut draw);
                let q = q.ok_or_else(|| {
                    let [x, y, z] = fixture.centre_mm;
                    format!(
                        "`{}` at [{x}, {y}, {z}] mm is out of reach within the joints' limits and above poses.floor_mm",
                        fixture.name
                    )
                })?;
                touches.push(Touch {
                    fixture: number,
                    q,
                    time_s,
                    temperature_c,
                });
            }
        }
        Ok(touches)
    }

    /// Joints at which the settled arm holds the ball at a point, m, coming from joints `before`.
    fn reach(
        &self,
        Scene { arm, effects, .. }: &Scene,
        ranges: &[[f64; 2]],
        (there, before): (Vector, Option<&[f64]>),
        [time_s, temperature_c]: [f64; 2],
        draw: &mut Noise,
    ) -> Option<Vec<f64>> {
        let joints = ranges.len();
        let ball = |q: &[f64]| -> Vector {
            let mut direction = vec![0.0; joints];
            for (side, (q, before)) in direction
                .iter_mut()
                .zip(q.iter().zip(before.unwrap_or(&[])))
            {
                *side = (q - before).signum();
            }
            let row = Row {
                command: q.to_vec(),
                drive: self.truth.drive(self.robot, q),
                direction,
                time_s,
                temperature_c,
                payload_kg: 0.0,
                velocity: Vec::new(),
                memory: Vec::new(),
            };
            settle(arm, &row, effects).posture.tool
        };
        let anywhere = Poses {
            floor_mm: f64::NEG_INFINITY,
            clearance_mm: 0.0,
            ..self.poses.clone()
        };
        for _ in 0..TRIES {
            let (mut q, _) = plan::allowed(arm, &anywhere, ranges, draw).ok()?;
            for _ in 0..STEPS {
                let tool = ball(&q);
                let left = matrix::minus(there, tool);
                if matrix::norm(left) < THERE {
                    // The ball may lie below the floor.
                    let posture = arm.posture(&q, &Motion::none(joints));
                    let is_above = posture.is_above(1e-3 * self.poses.floor_mm);
                    if within(&q, ranges, 0.0) && is_above {
                        return Some(q);
                    }
                    break;
                }
                let moved = |joint: usize| {
                    let mut nearby = q.clone();
                    nearby[joint] += STEP;
                    matrix::scale(matrix::minus(ball(&nearby), tool), 1.0 / STEP)
                };
                let columns: Vec<Vector> = (0..joints).map(moved).collect();
                let Some(step) = least_step(&columns, left) else {
                    break;
                };
                let largest = step.iter().fold(0.0f64, |most, turn| most.max(turn.abs()));
                let share = (FAR / largest.max(1e-12)).min(1.0);
                let turns = q.iter_mut().zip(&step);
                turns.for_each(|(q, turn)| *q += share * turn);
                if !within(&q, ranges, FAR) {
                    break;
                }
            }
        }
        None
    }
}

/// Whether joints are in their ranges, or out of them by no more than this: Newton's steps may come back.
fn within(q: &[f64], ranges: &[[f64; 2]], beyond: f64) -> bool {
    let mut joints = q.iter().zip(ranges);
    joints.all(|(q, [lower, upper])| *q >= lower - beyond && *q <= upper + beyond)
}

/// The shortest step whose columns sum up to `left`; none near a singular posture.
fn least_step(columns: &[Vector], left: Vector) -> Option<Vec<f64>> {
    let line = |i: usize| -> Vector {
        std::array::from_fn(|j| columns.iter().map(|column| column[i] * column[j]).sum())
    };
    let [a, b, c] = [line(0), line(1), line(2)];
    let volume = matrix::dot(a, matrix::cross(b, c));
    if volume < 1e-9 {
        return None;
    }
    // Cramer's rule on the symmetric square.
    let [first, second, third] = [(b, c), (c, a), (a, b)].map(|(u, v)| matrix::cross(u, v));
    let pull: Vector = std::array::from_fn(|i| {
        (first[i] * left[0] + second[i] * left[1] + third[i] * left[2]) / volume
    });
    let step = columns.iter().map(|column| matrix::dot(*column, pull));
    Some(step.collect())
}
