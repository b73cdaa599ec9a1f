//! Where the arm may go: joint ranges, a box and a floor for what is known of the arm, and the payloads at hand.

use crate::criteria::choose::TRIES;
use crate::robot::{Measurements, Named, PointReadings, RobotModel};
use crate::spatial::Pose;
use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

/// Allowed poses. Collisions of the arm with itself or with things are not known here.
#[derive(Debug, Clone)]
pub struct Site {
    /// Range of every joint, rad or m.
    pub ranges: Vec<[f64; 2]>,
    /// Range of the measured point along x, y, z of the base frame, m; infinite where free.
    pub bounds: [[f64; 2]; 3],
    /// Height (z of the base frame, m) below which neither the measured point nor a link's centre of mass may be. Centres that
    /// are lower at the zero pose are not watched.
    pub floor: f64,
    /// kg, at least one.
    pub payloads: Vec<f64>,
}

/// What stands beside joints and payload in rows that are yet to be measured; none where the recording has no such column.
#[derive(Debug, Clone, Default)]
pub struct Circumstances {
    /// s on the recording's clock.
    pub time: Option<f64>,
    /// Temperature of the arm, C.
    pub temperature: Option<f64>,
    /// The target that is measured, where there are several.
    pub target: Option<String>,
}

impl Circumstances {
    /// Fills them in, with either side of approach of every joint by chance where rows have none.
    pub(super) fn complete(&self, data: &mut Measurements, draw: &mut ChaCha8Rng) {
        let rows = data.rows();
        data.time = self.time.map(|time| vec![time; rows]);
        data.temperature = self.temperature.map(|temperature| vec![temperature; rows]);
        data.target = self
            .target
            .as_deref()
            .map(|name| Named::of((0..rows).map(|_| name)));
        let sides = data.direction.get_or_insert_default();
        sides.extend(
            (sides.len()..rows * data.joints)
                .map(|_| if draw.random::<bool>() { 1.0 } else { -1.0 }),
        );
    }
}

impl Site {
    /// `count` even random poses, each once with every payload; fails with a sentence when the region is (nearly) empty.
    pub fn draw(
        &self,
        robot: &RobotModel,
        count: usize,
        sigma: f64,
        seed: u64,
    ) -> Result<Measurements, String> {
        let mut draw = ChaCha8Rng::seed_from_u64(seed);
        let mut out = Measurements {
            joints: robot.joints(),
            ..Measurements::default()
        };
        for _ in 0..count {
            let q = (0..*TRIES).find_map(|_| {
                let q: Vec<f64> = self
                    .ranges
                    .iter()
                    .map(|[lower, upper]| lower + (upper - lower) * draw.random::<f64>())
                    .collect();
                self.allows(robot, &q).then_some(q)
            });
            let Some(q) = q else {
                return Err(format!(
                    "no pose of {} random ones is inside the box and above the floor: widen the box or limits, or lower the floor",
                    *TRIES
                ));
            };
            self.push(&mut out, robot, &q, sigma);
        }
        Ok(out)
    }

    /// The poses themselves, then allowed neighbours of each: every joint alone moved by up to `step` of its range, or to its ends,
    /// and all joints together; with every payload.
    pub(super) fn around(
        &self,
        robot: &RobotModel,
        poses: &Measurements,
        step: f64,
        draw: &mut ChaCha8Rng,
    ) -> Measurements {
        let mut out = poses.clone();
        for row in 0..poses.rows() {
            let here = poses.q(row);
            let sigma = poses.points.sigma[row].x;
            let mut offer = |q: Vec<f64>| {
                if self.allows(robot, &q) {
                    self.push(&mut out, robot, &q, sigma);
                }
            };
            for (joint, [lower, upper]) in self.ranges.iter().enumerate() {
                let width = step * (upper - lower);
                let by = |target: f64| {
                    let mut q = here.to_vec();
                    q[joint] = target.clamp(*lower, *upper);
                    q
                };
                offer(by(here[joint] - width * draw.random::<f64>()));
                offer(by(here[joint] + width * draw.random::<f64>()));
                offer(by(if here[joint] > 0.5 * (lower + upper) {
                    *upper
                } else {
                    *lower
                }));
            }
            for _ in 0..2 {
                let moved = here
                    .iter()
                    .zip(&self.ranges)
                    .map(|(value, [lower, upper])| {
                        (value + step * (upper - lower) * (draw.random::<f64>() - 0.5))
                            .clamp(*lower, *upper)
                    });
                offer(moved.collect());
            }
            offer(here.to_vec());
        }
        out
    }

    /// Whether a pose is inside the box and above the floor.
    pub(crate) fn allows(&self, robot: &RobotModel, q: &[f64]) -> bool {
        let mut frame = Pose::identity();
        for ((twist, value), joint) in robot
            .screws()
            .iter()
            .zip(q)
            .zip(&robot.description().joints)
        {
            frame = frame * Pose::exp(&(twist * *value));
            if let Some(centre) = joint.centre.filter(|centre| centre[2] >= self.floor)
                && frame.point(&Vector3::from(centre)).z < self.floor
            {
                return false;
            }
        }
        let point = frame.point(&robot.home().translation);
        point.z >= self.floor
            && point
                .iter()
                .zip(&self.bounds)
                .all(|(value, [lower, upper])| (lower..=upper).contains(&value))
    }

    fn push(&self, out: &mut Measurements, robot: &RobotModel, q: &[f64], sigma: f64) {
        let point = robot.forward(q).translation;
        for payload in &self.payloads {
            out.q.extend_from_slice(q);
            out.points.push(point, sigma);
            out.payload.push(*payload);
        }
    }
}

/// Rows of positions within the ranges, row-major: even and reproducible (an additive recurrence).
pub(crate) fn even(ranges: &[[f64; 2]], rows: usize) -> Vec<f64> {
    // The root of x^(d+1) = x + 1.
    let power = 1.0 / (ranges.len() as f64 + 1.0);
    let root = (0..60).fold(2.0f64, |x, _| (1.0 + x).powf(power));
    let position = |row: usize, joint: usize| {
        let share = (0.5 + (row + 1) as f64 * root.powi(-(joint as i32 + 1))).fract();
        let [lower, upper] = ranges[joint];
        lower + (upper - lower) * share
    };
    (0..rows)
        .flat_map(|row| (0..ranges.len()).map(move |joint| (row, joint)))
        .map(|(row, joint)| position(row, joint))
        .collect()
}

/// `rows` poses within the limits, rad or m, with the declared payload; a joint without limits keeps within 1 of its zero.
pub fn spread(robot: &RobotModel, rows: usize) -> Measurements {
    let description = robot.description();
    let limits = description
        .joints
        .iter()
        .map(|joint| joint.limits.unwrap_or([-1.0, 1.0]));
    Measurements {
        joints: robot.joints(),
        q: even(&limits.collect::<Vec<_>>(), rows),
        points: PointReadings::new(vec![Vector3::zeros(); rows], 0.0),
        payload: vec![description.payload_mass; rows],
        ..Measurements::default()
    }
}
