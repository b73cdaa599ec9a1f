//! The experiment: every planned point settled, seen by the tracker, with the currents that the controller would log; or a way of
//! the moving arm, on which statics hold all the same: it is slow against its own vibrations.

use super::arm::{Arm, Link, Loads, Motion, Posture, Row};
use super::effect::{self, JointCompliance, Physical, State};
use super::matrix::{self, Matrix, Vector};
use super::memory;
use super::noise::{Noise, Purpose};
use super::plan::{self, Block, Climate, Point, Poses};
use super::tracker::{Beam, Tracker};
use super::truth::{ARCSEC, TrueRobot};
use super::way::{JointState, Path, Way};
use calib_foundation::description::RobotDescription;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::iter::repeat_n;

/// The motors as the controller logs them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Motors {
    /// +1 where a positive current drives the joint in its positive direction, else -1; empty: all +1.
    pub sign: Vec<f64>,
    /// Standard deviation of a logged current, A.
    pub(crate) noise_a: f64,
}

/// An experiment on a twin.
#[derive(Debug, Clone)]
pub struct Experiment<'a> {
    /// As its owner believes it to be.
    pub robot: &'a RobotDescription,
    /// As it is.
    pub truth: &'a TrueRobot,
    pub effects: &'a [Physical],
    /// Where it stands and how well it measures.
    pub tracker: &'a Tracker,
    /// As the controller logs them.
    pub motors: &'a Motors,
    /// Standard deviation of each joint from move to move, arcsec (um for a prismatic joint); empty: none.
    pub repeatability_arcsec: &'a [f64],
    pub poses: &'a Poses,
    /// In the order of measurement.
    pub blocks: &'a [Block],
    /// Clock and temperature.
    pub climate: &'a Climate,
    /// The seed of poses and noise.
    pub seed: u64,
}

/// A measured point.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// Number of its block, from 0.
    pub block: usize,
    /// Reported joint positions, rad or m.
    pub q: Vec<f64>,
    /// Side from which each joint came, +1 or -1.
    pub direction: Vec<f64>,
    pub time_s: f64,
    pub temperature_c: f64,
    /// Declared mass at the flange, kg.
    pub payload_kg: f64,
    /// Logged currents, A.
    pub current: Vec<f64>,
    /// Tracker frame, m, and its standard deviation per axis.
    pub position: Vector,
    /// m.
    pub sigma: f64,
    /// Velocities as the controller logs them, rad/s or m/s; empty where the arm stood.
    pub velocity: Vec<f64>,
}

/// What is measured, with all its effects, and with which instrument.
pub(super) struct Scene<'a> {
    pub(super) arm: Arm,
    pub(super) effects: Vec<Physical>,
    tracker: &'a Tracker,
    base: Matrix,
}

impl Scene<'_> {
    /// A row of a block as the tracker sees it, with joints logged at `q` after a move from `before`; currents and velocities apart.
    fn shot(
        &self,
        (block, row): (usize, Row),
        mut q: Vec<f64>,
        before: &[f64],
        beam: &mut Beam,
    ) -> (Shot, Equilibrium) {
        let settled = settle(&self.arm, &row, &self.effects);
        let seen = sighted(&settled, &self.base, &row, &self.effects);
        for effect in &self.effects {
            effect.log(&mut q, before);
        }
        let shot = Shot {
            block,
            q,
            direction: row.direction,
            time_s: row.time_s,
            temperature_c: row.temperature_c,
            payload_kg: row.payload_kg,
            current: Vec::new(),
            position: self.tracker.measure(seen, beam),
            sigma: self.tracker.sigma(seen),
            velocity: Vec::new(),
        };
        (shot, settled)
    }
}

impl Experiment<'_> {
    /// All points in order; `tick` hears of each. Fails with what is wrong where no pose is allowed.
    pub fn record(&self, tick: impl FnMut()) -> Result<Vec<Shot>, String> {
        let arm = Arm::new(self.robot, self.truth);
        let (poses, blocks, climate) = (self.poses, self.blocks, self.climate);
        let points = plan::plan(self.robot, &arm, poses, blocks, climate, self.seed)?;
        Ok(self.measure(points, tick))
    }

    /// The moving arm: rows of all blocks one after another along one way. No currents: the motors accelerate the arm, too.
    pub fn follow(&self, way: &Way, mut tick: impl FnMut()) -> Result<Vec<Shot>, String> {
        let scene = self.scene();
        let rows: usize = self.blocks.iter().map(|block| block.points).sum();
        let (arm, seconds) = (Arm::new(self.robot, self.truth), rows as f64 / way.rate_hz);
        let path = Path::draw(way, self.robot, &arm, self.poses, seconds, self.seed)?;
        let later: f64 = scene.effects.iter().map(|effect| effect.later()).sum();
        let times = (0..rows).map(|row| row as f64 / way.rate_hz);
        let begin_s = self.climate.begin_s;
        let warmth = |since_s: f64| self.climate.temperature(begin_s + since_s);
        let course = times.map(|since_s| {
            let JointState { q, .. } = path.at(since_s + later);
            (q, begin_s + since_s, warmth(since_s))
        });
        let mut memories = effect::recall(&scene.effects, &memory::along(course));
        let mut beam = Beam::new(self.seed);
        let mut play = Noise::new(self.seed, Purpose::Repeatability);
        let lasts = match way.wander_s > 0.0 {
            true => (-1.0 / (way.rate_hz * way.wander_s)).exp(),
            false => 0.0,
        };
        let joints = self.repeatability_arcsec.iter();
        let mut deviations: Vec<f64> = joints.map(|_| play.normal()).collect();
        let mut direction = vec![0.0; scene.arm.links.len()];
        let blocks = self.blocks.iter().enumerate();
        let blocks = blocks.flat_map(|(number, block)| repeat_n((number, block), block.points));
        let mut shots = Vec::with_capacity(rows);
        for (row, (block, load)) in blocks.enumerate() {
            let since_s = row as f64 / way.rate_hz;
            let (logged, JointState { q: command, v, .. }) =
                (path.at(since_s), path.at(since_s + later));
            let mut drive = self.truth.drive(self.robot, &command);
            for deviation in &mut deviations {
                *deviation = lasts * *deviation + (1.0 - lasts * lasts).sqrt() * play.normal();
            }
            self.scatter(&mut drive, &scene.arm, |joint| deviations[joint]);
            for (side, speed) in direction.iter_mut().zip(&v) {
                *side = if *speed == 0.0 { *side } else { speed.signum() };
            }
            let row = Row {
                command,
                drive,
                direction: direction.clone(),
                time_s: begin_s + since_s,
                temperature_c: warmth(since_s),
                payload_kg: load.payload_kg,
                velocity: v,
                memory: std::mem::take(&mut memories[row]),
            };
            let before = logged.q.clone();
            let (shot, _) = scene.shot((block, row), logged.q, &before, &mut beam);
            let velocity = if way.log_velocity { logged.v } else { vec![] };
            shots.push(Shot { velocity, ..shot });
            tick();
        }
        Ok(shots)
    }

    /// The given points in order.
    pub fn measure(&self, points: Vec<Point>, mut tick: impl FnMut()) -> Vec<Shot> {
        let scene = self.scene();
        let mut beam = Beam::new(self.seed);
        let mut meter = Noise::new(self.seed, Purpose::Current);
        let mut play = Noise::new(self.seed, Purpose::Repeatability);
        let memories = effect::recall(&scene.effects, &memory::past(&points));
        let mut shots = Vec::with_capacity(points.len());
        for (point, memory) in points.into_iter().zip(memories) {
            let mut drive = self.truth.drive(self.robot, &point.q);
            self.scatter(&mut drive, &scene.arm, |_| play.normal());
            let row = point.row(drive, memory);
            let (shot, settled) = scene.shot((point.block, row), point.q, &point.before, &mut beam);
            let current = self.currents(&scene.arm, &settled.torque, &settled.motion, &mut meter);
            shots.push(Shot { current, ..shot });
            tick();
        }
        shots
    }

    /// The arm as its effects shape it: the chosen ones, and the true robot's linear wind-up.
    pub(super) fn scene(&self) -> Scene<'_> {
        let mut arm = Arm::new(self.robot, self.truth);
        let wind_up = arm.links.iter().enumerate().map(|(joint, link)| {
            let per_ampere = link.gear * link.motor_constant;
            JointCompliance::effect(joint + 1, self.truth.compliance(joint, per_ampere))
        });
        let effects: Vec<Physical> = wind_up.chain(self.effects.iter().cloned()).collect();
        effects.iter().for_each(|effect| effect.shape(&mut arm));
        Scene {
            arm,
            effects,
            tracker: self.tracker,
            base: self.tracker.base(),
        }
    }

    /// Moves joints (rad or m) by their repeatability, so many standard deviations each.
    fn scatter(&self, drive: &mut [f64], arm: &Arm, mut by: impl FnMut(usize) -> f64) {
        let sigmas = self.repeatability_arcsec.iter().zip(&arm.links);
        for (joint, (position, (sigma, link))) in drive.iter_mut().zip(sigmas).enumerate() {
            *position += sigma * if link.revolute { ARCSEC } else { 1e-6 } * by(joint);
        }
    }

    /// Holding currents: the motor carries what gravity and springs do to the joint, plus what friction adds.
    fn currents(&self, arm: &Arm, torque: &[f64], motion: &Motion, meter: &mut Noise) -> Vec<f64> {
        let carried = torque.iter().zip(&motion.motor_torque);
        let current = |(joint, (link, (gravity, extra))): (usize, (&Link, (&f64, &f64)))| {
            let sign = self.motors.sign.get(joint).copied().unwrap_or(1.0);
            let held = (extra - gravity) / (link.gear * link.motor_constant);
            sign * held + self.motors.noise_a * meter.normal()
        };
        let joints = arm.links.iter().zip(carried).enumerate();
        joints.map(current).collect()
    }
}

/// The arm at rest under its loads.
#[derive(Debug, Clone)]
pub struct Equilibrium {
    /// Where everything is.
    pub posture: Posture,
    /// What the effects move.
    pub motion: Motion,
    /// Torque of gravity and of other loads on each joint in the deflected posture, Nm.
    pub torque: Vec<f64>,
}

/// A change of less than this (rad, m or Nm) is rest; a picometre at 3 m.
const REST: f64 = 1e-13;
/// Every round shrinks the change by the wind-up itself, about 1e-3: six are usual, more than this many mean a collapsing arm.
const ROUNDS: usize = 60;

/// Lets the arm sag until loads and deflections agree.
pub fn settle(arm: &Arm, row: &Row, effects: &[Physical]) -> Equilibrium {
    let mut motion = Motion::none(arm.links.len());
    for _ in 0..ROUNDS {
        let held = hold(arm, row, motion);
        let mut next = Motion::none(arm.links.len());
        for (index, effect) in effects.iter().enumerate() {
            let state = State {
                arm,
                row,
                posture: &held.0,
                loads: &held.1,
                torque: &held.2,
                memory: remembered(row, index),
            };
            effect.act(&state, &mut next);
        }
        let change = next.distance(&held.3);
        motion = next;
        if change < REST {
            break;
        }
    }
    let (posture, _, torque, motion) = hold(arm, row, motion);
    Equilibrium {
        posture,
        motion,
        torque,
    }
}

/// What the tracker reads of the measured point, m in its frame, without its noise; `base` is the base frame as it sees it at first.
pub fn sighted(at_rest: &Equilibrium, base: &Matrix, row: &Row, effects: &[Physical]) -> Vector {
    let frame = matrix::times(&at_rest.motion.tracker, base);
    let there = matrix::place(&frame, at_rest.posture.tool);
    let sight = |point, (index, effect): (usize, &Physical)| {
        effect.sight(row, remembered(row, index), point)
    };
    effects.iter().enumerate().fold(there, sight)
}

fn remembered(row: &Row, effect: usize) -> f64 {
    row.memory.get(effect).copied().unwrap_or(0.0)
}

fn hold(arm: &Arm, row: &Row, motion: Motion) -> (Posture, Loads, Vec<f64>, Motion) {
    let pairs = row.drive.iter().zip(&motion.joint);
    let angle: Vec<f64> = pairs.map(|(drive, extra)| drive + extra).collect();
    let posture = arm.posture(&angle, &motion);
    let loads = Loads::new(arm, &posture, row.payload_kg);
    let gravity = loads.torques(arm, &posture);
    let pairs = gravity.iter().zip(&motion.load);
    let torque = pairs.map(|(gravity, load)| gravity + load).collect();
    (posture, loads, torque, motion)
}
