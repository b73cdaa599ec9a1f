//! The measurement plan: poses within the limits, above the floor, evenly in the workspace; when, how warm, with which load.
//!
//! Each pose is the best of several random ones: the one whose tool point lies farthest from the block's earlier points
//! (Mitchell's best candidate), so that points spread over the workspace instead of crowding where many postures reach.

use crate::arm::{Arm, Motion, Row};
use crate::matrix;
use crate::matrix::Vector;
use crate::noise::{Noise, Purpose};
use calib_foundation::description::{JointDescription, JointKind, RobotDescription};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Which poses may be measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Poses {
    /// Range of every joint, deg (mm for a prismatic joint); empty: the robot's limits.
    pub range_deg: Vec<[f64; 2]>,
    /// No joint and no tool point lower than this above the base's origin, mm.
    pub floor_mm: f64,
    /// The tool point no nearer to the first axis than this, mm.
    pub clearance_mm: f64,
    /// Random poses from which each measured one is chosen; 1 draws plainly at random.
    pub candidates: usize,
}

impl Default for Poses {
    fn default() -> Self {
        Self {
            range_deg: Vec::new(),
            floor_mm: 200.0,
            clearance_mm: 600.0,
            candidates: 10,
        }
    }
}

/// A run of points: poses that are given, then poses that are drawn.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// The label of its rows in the column `usage`, e.g. `fit`.
    pub usage: String,
    /// Poses that are drawn.
    #[serde(default)]
    pub points: usize,
    /// Mass at the flange, kg.
    #[serde(default)]
    pub payload_kg: f64,
    /// Poses in the order of measurement, e.g. those of `calib poses`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub given: Vec<GivenPose>,
}

impl Block {
    /// Points, given and drawn.
    pub fn count(&self) -> usize {
        self.given.len() + self.points
    }
}

/// The keys and messages of rules that are not kept.
pub(super) fn broken<const N: usize>(
    rules: [(bool, &'static str, &'static str); N],
) -> Vec<(&'static str, &'static str)> {
    let broken = rules.into_iter().filter(|(kept, ..)| !kept);
    broken.map(|(_, key, message)| (key, message)).collect()
}

/// Given poses of all blocks, with their places.
pub fn given(blocks: &[Block]) -> impl Iterator<Item = (String, &GivenPose)> {
    blocks.iter().enumerate().flat_map(|(block, all)| {
        let place = move |pose| format!("blocks[{block}].given[{pose}]");
        let poses = all.given.iter().enumerate();
        poses.map(move |(pose, given)| (place(pose), given))
    })
}

/// The clock and the temperature of the arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Climate {
    /// Shortest and longest time from one point to the next, s.
    pub pace_s: [f64; 2],
    /// The clock at the start, s: a later measurement of the same robot goes on with the time and the warmth of an earlier one.
    #[serde(skip_serializing_if = "is_none")]
    pub begin_s: f64,
    /// Temperature at the start, C.
    pub start_c: f64,
    /// Rise of the warm arm over the cold one, K.
    pub rise_k: f64,
    /// Time constant of the warm-up, h.
    pub warm_up_h: f64,
    /// A swing of the temperature on top, K, and its period, h: sun, doors, pauses.
    #[serde(skip_serializing_if = "is_none")]
    pub swing_k: f64,
    /// Period of the swing, h.
    #[serde(skip_serializing_if = "usual_swing")]
    pub swing_h: f64,
}

const SWING_H: f64 = 1.0;

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_none(value: &f64) -> bool {
    *value == 0.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn usual_swing(hours: &f64) -> bool {
    *hours == SWING_H
}

impl Default for Climate {
    fn default() -> Self {
        Self {
            pace_s: [15.0, 25.0],
            begin_s: 0.0,
            start_c: 20.0,
            rise_k: 0.0,
            warm_up_h: 1.5,
            swing_k: 0.0,
            swing_h: SWING_H,
        }
    }
}

impl Climate {
    /// Temperature of the arm at a time, C.
    pub fn temperature(&self, time_s: f64) -> f64 {
        let warm = self.start_c + self.rise_k * (1.0 - (-time_s / (3600.0 * self.warm_up_h)).exp());
        if self.swing_k == 0.0 {
            warm
        } else {
            warm + self.swing_k * (TAU * time_s / (3600.0 * self.swing_h)).sin()
        }
    }
}

/// The side to which each joint moved last: +1, -1, or 0 where it stood still.
pub fn direction(now: &[f64], before: &[f64]) -> Vec<f64> {
    let side = |(now, then): (&f64, &f64)| match now == then {
        true => 0.0,
        false => (now - then).signum(),
    };
    now.iter().zip(before).map(side).collect()
}

/// A planned point.
#[derive(Debug, Clone)]
pub struct Point {
    /// Number of its block, from 0.
    pub block: usize,
    /// Commanded joints, rad or m.
    pub q: Vec<f64>,
    /// The point from which the arm came.
    pub before: Vec<f64>,
    /// Side from which each joint comes, +1 or -1.
    pub direction: Vec<f64>,
    pub time_s: f64,
    pub temperature_c: f64,
    /// Declared mass at the flange, kg.
    pub payload_kg: f64,
}

impl Point {
    /// The row of this point, with joints at the gears' outputs and what effects make of the rows before.
    pub(crate) fn row(&self, drive: Vec<f64>, memory: Vec<f64>) -> Row {
        Row {
            command: self.q.clone(),
            drive,
            direction: self.direction.clone(),
            time_s: self.time_s,
            temperature_c: self.temperature_c,
            payload_kg: self.payload_kg,
            velocity: Vec::new(),
            memory,
        }
    }
}

/// Random poses that may be rejected before the plan gives up on a point.
const TRIES: usize = 100_000;

/// Points of all blocks in order; fails with what is wrong where no pose is allowed.
pub fn plan(
    robot: &RobotDescription,
    arm: &Arm,
    poses: &Poses,
    blocks: &[Block],
    climate: &Climate,
    seed: u64,
) -> Result<Vec<Point>, String> {
    // Nothing is drawn where all poses are given: then the robot needs no limits.
    let ranges = match blocks.iter().all(|block| block.points == 0) {
        true => Vec::new(),
        false => ranges(robot, poses)?,
    };
    let mut draw = Noise::new(seed, Purpose::Poses);
    let mut clock = Noise::new(seed, Purpose::Clock);
    let (mut out, mut time, mut before): (Vec<Point>, f64, _) =
        (Vec::new(), climate.begin_s, vec![0.0; robot.joints.len()]);
    let mut tick = |q: Vec<f64>, block: usize, payload_kg: f64| {
        time += clock.uniform(climate.pace_s[0], climate.pace_s[1]);
        let before = std::mem::replace(&mut before, q.clone());
        Point {
            block,
            q,
            before,
            direction: Vec::new(),
            time_s: time,
            temperature_c: climate.temperature(time),
            payload_kg,
        }
    };
    for (number, block) in blocks.iter().enumerate() {
        let mut taken: Vec<Vector> = Vec::with_capacity(block.count());
        for pose in &block.given {
            let (q, short) = pose.postures(robot);
            taken.push(arm.posture(&q, &Motion::none(arm.links.len())).tool);
            let straight = tick(q, number, pose.payload_kg.unwrap_or(block.payload_kg));
            out.push(Point {
                before: short.unwrap_or_else(|| straight.before.clone()),
                ..straight
            });
        }
        for _ in 0..block.points {
            let mut best: Option<(f64, Vec<f64>, Vector)> = None;
            for _ in 0..poses.candidates.max(1) {
                let (q, tool) = allowed(arm, poses, &ranges, &mut draw)?;
                let away = |other: &Vector| matrix::norm(matrix::minus(tool, *other));
                let room = taken.iter().map(away).fold(f64::INFINITY, f64::min);
                if best.as_ref().is_none_or(|(most, _, _)| room > *most) {
                    best = Some((room, q, tool));
                }
            }
            let Some((_, q, tool)) = best else { continue };
            taken.push(tool);
            out.push(tick(q, number, block.payload_kg));
        }
    }
    out.iter_mut()
        .for_each(|point| point.direction = direction(&point.q, &point.before));
    Ok(out)
}

/// The range of every joint, rad or m; fails where the robot has no limits and the poses no ranges.
pub(super) fn ranges(robot: &RobotDescription, poses: &Poses) -> Result<Vec<[f64; 2]>, String> {
    if poses.range_deg.is_empty() {
        let limits = |(index, joint): (usize, &JointDescription)| {
            let none = || format!("joint {} has no limits; give poses.range_deg", index + 1);
            joint.limits.ok_or_else(none)
        };
        return robot.joints.iter().enumerate().map(limits).collect();
    }
    let (ranges, joints) = (poses.range_deg.len(), robot.joints.len());
    if ranges != joints {
        return Err(format!(
            "poses.range_deg has {ranges} ranges, the robot {joints} joints"
        ));
    }
    let pairs = poses.range_deg.iter().zip(&robot.joints);
    let ranges = pairs.map(|(range, joint)| range.map(|x| si(x, joint.kind)));
    Ok(ranges.collect())
}

/// A position of a joint in deg or mm, in rad or m.
pub(super) fn si(value: f64, kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => value.to_radians(),
        JointKind::Prismatic => 1e-3 * value,
    }
}

/// A random pose within `ranges` (rad or m) and its tool point; fails with what to widen where none is allowed.
pub fn allowed(
    arm: &Arm,
    poses: &Poses,
    ranges: &[[f64; 2]],
    draw: &mut Noise,
) -> Result<(Vec<f64>, Vector), String> {
    let floor = 1e-3 * poses.floor_mm;
    let at_rest = Motion::none(arm.links.len());
    for _ in 0..TRIES {
        let drawn = ranges.iter().map(|range| draw.uniform(range[0], range[1]));
        let q: Vec<f64> = drawn.collect();
        let posture = arm.posture(&q, &at_rest);
        let far = posture.tool[0].hypot(posture.tool[1]) >= 1e-3 * poses.clearance_mm;
        let high = posture.is_above(floor) && posture.tool[2] >= floor;
        if far && high {
            return Ok((q, posture.tool));
        }
    }
    Err(format!(
        "no pose in {TRIES} keeps {} mm above the floor and {} mm from the first axis; widen poses.range_deg or lower poses.floor_mm, poses.clearance_mm",
        poses.floor_mm, poses.clearance_mm
    ))
}

/// A pose to measure. It is driven to as it is: neither the floor nor the ranges of drawn poses are asked for.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GivenPose {
    /// Every joint, deg (mm for a prismatic joint).
    pub joints_deg: Vec<f64>,
    /// The side to which each joint moves last: +1 upwards, -1 downwards, 0: it stands already. Before the pose the arm stops 5 deg
    /// (5 mm) short of it on the other side. Empty: straight from the pose before.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub direction: Vec<f64>,
    /// Mass at the flange, kg; missing: the block's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub payload_kg: Option<f64>,
}

/// How far off a pose the arm stops before its last move, deg or mm: more than any lost motion or hysteresis needs.
const SHORT: f64 = 5.0;

impl GivenPose {
    /// The joints, rad or m, and where the arm stops before, if it does.
    pub(super) fn postures(&self, robot: &RobotDescription) -> (Vec<f64>, Option<Vec<f64>>) {
        let joints = || self.joints_deg.iter().zip(&robot.joints);
        let q = joints().map(|(value, joint)| si(*value, joint.kind));
        let sides = joints().zip(&self.direction);
        let short = sides.map(|((value, joint), side)| si(value - side * SHORT, joint.kind));
        let stops = !self.direction.is_empty();
        (q.collect(), stops.then(|| short.collect()))
    }

    /// What cannot be, whatever the robot: place below the pose and message.
    pub fn faults(&self) -> Vec<(&'static str, &'static str)> {
        let mut joints = self.joints_deg.iter();
        let finite = !self.joints_deg.is_empty() && joints.all(|value| value.is_finite());
        let mut sides = self.direction.iter();
        let mass = self.payload_kg.unwrap_or(0.0);
        let rules = [
            (
                finite,
                "joints_deg",
                "expected a number for every joint, deg (mm for a prismatic joint)",
            ),
            (
                sides.all(|side| [-1.0, 0.0, 1.0].contains(side)),
                "direction",
                "allowed: 1, -1 or 0 for every joint, or nothing",
            ),
            (
                mass.is_finite() && mass >= 0.0,
                "payload_kg",
                "expected a mass, 0 or more",
            ),
        ];
        broken(rules)
    }

    /// What this robot cannot do.
    pub fn against(&self, robot: &RobotDescription) -> Vec<(&'static str, String)> {
        let joints = robot.joints.len();
        let mut out = Vec::new();
        for (name, count) in [
            ("joints_deg", self.joints_deg.len()),
            ("direction", self.direction.len()),
        ] {
            if count != joints && (name == "joints_deg" || count > 0) {
                let message = format!("has {count} numbers, the robot {joints} joints");
                out.push((name, message));
            }
        }
        let (q, _) = self.postures(robot);
        for (index, (at, joint)) in q.iter().zip(&robot.joints).enumerate() {
            // A limit that was rounded to the decimals of a pose is no breach of it.
            let is_beyond = |[low, high]: &[f64; 2]| *at < low - 1e-6 || *at > high + 1e-6;
            if let Some(limits) = joint.limits.filter(is_beyond) {
                let (unit, [low, high]) = match joint.kind {
                    JointKind::Revolute => ("deg", limits.map(f64::to_degrees)),
                    JointKind::Prismatic => ("mm", limits.map(|metres| 1e3 * metres)),
                };
                let (number, at) = (index + 1, self.joints_deg[index]);
                let message =
                    format!("joint {number} is at {at} {unit}; allowed: {low:.3} to {high:.3}");
                out.push(("joints_deg", message));
            }
        }
        out
    }
}
