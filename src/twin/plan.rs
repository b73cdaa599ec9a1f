//! The measurement plan: poses within the limits, above the floor, evenly in the workspace; when, how warm, with which load.
//!
//! Each pose is the best of several random ones: the one whose tool point lies farthest from the block's earlier points
//! (Mitchell's best candidate), so that points spread over the workspace instead of crowding where many postures reach.

use super::arm::Arm;
use super::matrix::{self, Vector};
use super::motion::Motion;
use super::noise::{Noise, Purpose};
use crate::robot::description::RobotDescription;
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
        Self { range_deg: Vec::new(), floor_mm: 200.0, clearance_mm: 600.0, candidates: 10 }
    }
}

/// A run of points with one load.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Block {
    /// The label of its rows in the column `usage`, e.g. `fit`.
    pub usage: String,
    /// How many.
    pub points: usize,
    /// Mass at the flange, kg.
    #[serde(default)]
    pub payload_kg: f64,
}

/// The clock and the temperature of the arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Climate {
    /// Shortest and longest time from one point to the next, s.
    pub pace_s: [f64; 2],
    /// Temperature at the start, C.
    pub start_c: f64,
    /// Rise of the warm arm over the cold one, K.
    pub rise_k: f64,
    /// Time constant of the warm-up, h.
    pub warm_up_h: f64,
    /// A swing of the temperature on top, K, and its period, h: sun, doors, pauses.
    #[serde(skip_serializing_if = "no_swing")]
    pub swing_k: f64,
    /// Period of the swing, h.
    #[serde(skip_serializing_if = "usual_swing")]
    pub swing_h: f64,
}

const SWING_H: f64 = 1.0;

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn no_swing(kelvin: &f64) -> bool {
    *kelvin == 0.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn usual_swing(hours: &f64) -> bool {
    *hours == SWING_H
}

impl Default for Climate {
    fn default() -> Self {
        Self { pace_s: [15.0, 25.0], start_c: 20.0, rise_k: 0.0, warm_up_h: 1.5, swing_k: 0.0, swing_h: SWING_H }
    }
}

impl Climate {
    /// Temperature of the arm at a time, C.
    pub fn temperature(&self, time_s: f64) -> f64 {
        let warm = self.start_c + self.rise_k * (1.0 - (-time_s / (3600.0 * self.warm_up_h)).exp());
        if self.swing_k == 0.0 { warm } else { warm + self.swing_k * (TAU * time_s / (3600.0 * self.swing_h)).sin() }
    }
}

/// The side to which each joint moved last: +1, -1, or 0 where it stood still.
pub fn direction(now: &[f64], before: &[f64]) -> Vec<f64> {
    now.iter().zip(before).map(|(now, then)| if now == then { 0.0 } else { (now - then).signum() }).collect()
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
    /// s.
    pub time_s: f64,
    /// C.
    pub temperature_c: f64,
    /// Declared mass at the flange, kg.
    pub payload_kg: f64,
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
    let ranges = ranges(robot, poses)?;
    let mut draw = Noise::new(seed, Purpose::Poses);
    let mut clock = Noise::new(seed, Purpose::Clock);
    let (mut out, mut time, mut before) = (Vec::new(), 0.0, vec![0.0; ranges.len()]);
    for (number, block) in blocks.iter().enumerate() {
        let mut taken: Vec<Vector> = Vec::with_capacity(block.points);
        for _ in 0..block.points {
            let mut best: Option<(f64, Vec<f64>, Vector)> = None;
            for _ in 0..poses.candidates.max(1) {
                let (q, tool) = allowed(arm, poses, &ranges, &mut draw)?;
                let room = taken.iter().map(|other| matrix::norm(matrix::minus(tool, *other))).fold(f64::INFINITY, f64::min);
                if best.as_ref().is_none_or(|(most, _, _)| room > *most) {
                    best = Some((room, q, tool));
                }
            }
            let Some((_, q, tool)) = best else { continue };
            taken.push(tool);
            time += clock.uniform(climate.pace_s[0], climate.pace_s[1]);
            let from = std::mem::replace(&mut before, q.clone());
            let (direction, temperature_c) = (direction(&q, &from), climate.temperature(time));
            let payload_kg = block.payload_kg;
            out.push(Point { block: number, q, before: from, direction, time_s: time, temperature_c, payload_kg });
        }
    }
    Ok(out)
}

/// The range of every joint, rad or m; fails where the robot has no limits and the poses no ranges.
pub(super) fn ranges(robot: &RobotDescription, poses: &Poses) -> Result<Vec<[f64; 2]>, String> {
    if poses.range_deg.is_empty() {
        let limits =
            robot.joints.iter().enumerate().map(|(index, joint)| {
                joint.limits.ok_or_else(|| format!("joint {} has no limits; give poses.range_deg", index + 1))
            });
        return limits.collect();
    }
    if poses.range_deg.len() != robot.joints.len() {
        return Err(format!("poses.range_deg has {} ranges, the robot {} joints", poses.range_deg.len(), robot.joints.len()));
    }
    let si = |revolute: bool, x: f64| if revolute { x.to_radians() } else { 1e-3 * x };
    let joints = robot.joints.iter().map(|joint| joint.kind == crate::robot::description::JointKind::Revolute);
    Ok(poses.range_deg.iter().zip(joints).map(|(range, revolute)| range.map(|x| si(revolute, x))).collect())
}

/// A random pose within `ranges` (rad or m) and its tool point; fails with what to widen where none is allowed.
pub fn allowed(arm: &Arm, poses: &Poses, ranges: &[[f64; 2]], draw: &mut Noise) -> Result<(Vec<f64>, Vector), String> {
    let floor = 1e-3 * poses.floor_mm;
    let rest = Motion::none(arm.links.len());
    for _ in 0..TRIES {
        let q: Vec<f64> = ranges.iter().map(|range| draw.uniform(range[0], range[1])).collect();
        let posture = arm.posture(&q, &rest);
        let far = posture.tool[0].hypot(posture.tool[1]) >= 1e-3 * poses.clearance_mm;
        // Joints up to the second stand on the base, which may reach to the floor.
        let high = posture.frames.iter().skip(2).all(|frame| frame[2][3] >= floor) && posture.tool[2] >= floor;
        if far && high {
            return Ok((q, posture.tool));
        }
    }
    Err(format!(
        "no pose in {TRIES} keeps {} mm above the floor and {} mm from the first axis; widen poses.range_deg or lower poses.floor_mm, poses.clearance_mm",
        poses.floor_mm, poses.clearance_mm
    ))
}
