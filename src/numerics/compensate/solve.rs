//! Newton's method with least change of the joints, and the paper's single step (Wang et al. 2020, Fig. 2).

use crate::robot::{RobotModel, Travel};
use crate::spatial::{Pose, Twist};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use std::f64::consts::{PI, TAU};

/// m (rad at an arm's length of 1 m): nearer than this the wanted point is reached; controllers round to a micrometre or coarser.
pub const SETTLED: f64 = 1e-8;

/// Placements before it is given up.
const LIMIT: usize = 60;

/// The largest move of a joint in one step, rad or m: beyond it the Jacobian says nothing.
const STRIDE: f64 = 0.4;

/// An arm that can be placed, nominal or real. Frames: the base's.
pub trait Chain {
    /// The tool frame at joint positions `q` (rad or m).
    fn place(&mut self, q: &[f64]) -> Pose;
    /// Velocity (v; w) of the tool's origin by each joint, at the positions placed last.
    fn velocities(&self) -> &[Twist];
}

/// Velocity and turn.
pub(super) fn parts(twist: &Twist) -> (Vector3<f64>, Vector3<f64>) {
    (
        twist.fixed_rows::<3>(0).into(),
        twist.fixed_rows::<3>(3).into(),
    )
}

/// The robot as its file describes it.
pub struct Nominal<'a> {
    robot: &'a RobotModel,
    before: Vec<Pose>,
    velocities: Vec<Twist>,
}

impl<'a> Nominal<'a> {
    /// The solver of an arm.
    pub fn new(robot: &'a RobotModel) -> Self {
        let joints = robot.joints();
        Self {
            robot,
            before: vec![Pose::identity(); joints],
            velocities: vec![Twist::zeros(); joints],
        }
    }
}

impl Chain for Nominal<'_> {
    fn place(&mut self, q: &[f64]) -> Pose {
        let mut pose = Pose::identity();
        for (joint, (before, travel)) in self.before.iter_mut().zip(q).enumerate() {
            *before = pose;
            pose = pose * self.robot.motion(joint, &Travel::new(*travel));
        }
        let tool = pose * *self.robot.home();
        for (joint, (velocity, before)) in self.velocities.iter_mut().zip(&self.before).enumerate()
        {
            *velocity = self.robot.velocity(joint, before, &tool.translation);
        }
        tool
    }

    fn velocities(&self) -> &[Twist] {
        &self.velocities
    }
}

/// Where the tool shall be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolGoal {
    /// Base frame.
    pub pose: Pose,
    /// Whether the orientation counts, or the point alone.
    pub oriented: bool,
}

impl ToolGoal {
    /// How far (rad) `pose` is turned away.
    pub(crate) fn turn_left(&self, pose: &Pose) -> f64 {
        self.error(pose).fixed_rows::<3>(3).norm()
    }

    /// What is missing from `pose`: displacement (m) and turn (rad), base frame.
    fn error(&self, pose: &Pose) -> Twist {
        let v = self.pose.translation - pose.translation;
        let w = if self.oriented {
            let turn = self.pose.rotation * pose.rotation.transpose();
            Pose::new(turn, Vector3::zeros()).rotation_vector()
        } else {
            Vector3::zeros()
        };
        Twist::new(v.x, v.y, v.z, w.x, w.y, w.z)
    }
}

/// A command and how well it does.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandSolution {
    /// rad or m.
    pub q: Vec<f64>,
    /// What is left of the displacement, m, and of the turn, rad.
    pub residual: f64,
    /// What is left of the turn, rad.
    pub(crate) turn: f64,
    /// How far the start was off, m.
    pub(crate) before: f64,
    /// Steps taken.
    pub iterations: usize,
}

impl CommandSolution {
    fn of(q: Vec<f64>, before: &Twist, error: &Twist, iterations: usize) -> Self {
        let [before, residual] = [before, error].map(|error| error.fixed_rows::<3>(0).norm());
        Self {
            q,
            residual,
            turn: error.fixed_rows::<3>(3).norm(),
            before,
            iterations,
        }
    }
}

/// The joint positions nearest to `home` at which `chain` is where it is wanted, by Newton's method from `start`.
///
/// Redundant joints change least from `home`, in the sum of squares (1 rad counts as 1 m). Steps are damped where the arm
/// is singular; what cannot be reached is approached, and the residual says so.
pub fn least_change(
    chain: &mut impl Chain,
    wanted: &ToolGoal,
    start: &[f64],
    home: &[f64],
) -> CommandSolution {
    let mut q = start.to_vec();
    let before = wanted.error(&chain.place(&q));
    let mut error = before;
    let mut jacobian = chain.velocities().to_vec();
    let mut damping = 0.0;
    let mut trial = q.clone();
    let mut iterations = 0;
    // Whether the chain stands at `q` and not at a step that was refused.
    let mut placed = true;
    while iterations < LIMIT && (error.norm() > SETTLED) {
        let Some(step) = step(&jacobian, damping, (&error, wanted.oriented), &q, home) else {
            damping = harder(damping);
            iterations += 1;
            continue;
        };
        for ((to, from), by) in trial.iter_mut().zip(&q).zip(step) {
            *to = from + by;
        }
        let next = wanted.error(&chain.place(&trial));
        iterations += 1;
        placed = next.norm() < error.norm() || next.norm() <= SETTLED;
        if placed {
            (error, damping) = (next, if damping > 1e-9 { damping * 0.1 } else { 0.0 });
            jacobian.copy_from_slice(chain.velocities());
            std::mem::swap(&mut q, &mut trial);
        } else if damping > 1e3 {
            break;
        } else {
            damping = harder(damping);
        }
    }
    if !placed {
        chain.place(&q);
    }
    CommandSolution::of(q, &before, &error, iterations)
}

fn harder(damping: f64) -> f64 {
    if damping == 0.0 { 1e-6 } else { damping * 10.0 }
}

/// (J J^T + damping)^-1 of a twist, or of a displacement where the orientation does not count; none where the arm is singular.
fn solved(jacobian: &[Twist], damping: f64, error: &Twist, oriented: bool) -> Option<Vector6<f64>> {
    let solved = if oriented {
        let mut normal = Matrix6::zeros();
        for column in jacobian {
            normal += column * column.transpose();
        }
        let damping = damping * normal.trace() / 6.0;
        (normal + Matrix6::identity() * damping)
            .cholesky()?
            .solve(error)
    } else {
        let mut normal = Matrix3::zeros();
        for column in jacobian {
            let v: Vector3<f64> = column.fixed_rows::<3>(0).into();
            normal += v * v.transpose();
        }
        let damping = damping * normal.trace() / 3.0;
        let position: Vector3<f64> = error.fixed_rows::<3>(0).into();
        let v = (normal + Matrix3::identity() * damping)
            .cholesky()?
            .solve(&position);
        Vector6::new(v.x, v.y, v.z, 0.0, 0.0, 0.0)
    };
    solved
        .iter()
        .all(|value| value.is_finite())
        .then_some(solved)
}

/// d + J^T (J J^T + damping)^-1 (e - J d), d the way back to `home`; none where the arm is singular.
fn step<'a>(
    jacobian: &'a [Twist],
    damping: f64,
    (error, oriented): (&Twist, bool),
    q: &'a [f64],
    home: &'a [f64],
) -> Option<impl Iterator<Item = f64> + 'a> {
    // Pulled home, a damped step would rest between home and the wanted point.
    let pull = if damping == 0.0 { 1.0 } else { 0.0 };
    let back = move |(q, home): (&f64, &f64)| pull * (home - q);
    let mut remaining = *error;
    for (column, d) in jacobian.iter().zip(q.iter().zip(home).map(back)) {
        remaining -= column * d;
    }
    let solved = solved(jacobian, damping, &remaining, oriented)?;
    let raw = move |(column, d): (&Twist, f64)| d + column.dot(&solved);
    let largest = jacobian
        .iter()
        .zip(q.iter().zip(home).map(back))
        .map(raw)
        .fold(0.0, |most: f64, by| most.max(by.abs()));
    let share = if largest > STRIDE {
        STRIDE / largest
    } else {
        1.0
    };
    Some(
        jacobian
            .iter()
            .zip(q.iter().zip(home).map(back))
            .map(raw)
            .map(move |by| by * share),
    )
}

/// The paper's mapping: the predicted error at `home`, taken back once by the nominal Jacobian.
pub fn one_step(
    real: &mut impl Chain,
    nominal: &mut Nominal,
    wanted: &ToolGoal,
    home: &[f64],
) -> CommandSolution {
    let error = wanted.error(&real.place(home));
    nominal.place(home);
    let jacobian = nominal.velocities();
    let damped = [0.0, 1e-9, 1e-6]
        .into_iter()
        .find_map(|damping| step(jacobian, damping, (&error, wanted.oriented), home, home));
    let q: Vec<f64> = match damped {
        Some(step) => home.iter().zip(step).map(|(from, by)| from + by).collect(),
        None => home.to_vec(),
    };
    let left = wanted.error(&real.place(&q));
    CommandSolution::of(q, &error, &left, 1)
}

/// m or rad: what counts as reached before the identified model takes over.
pub(super) const REACHED: f64 = 1e-8;

/// Postures that are tried where the given one leads nowhere.
const POSTURES: u32 = 60;

/// Joint positions (rad or m) at which the nominal robot is where it is wanted, near to `from`; those that come nearest where it
/// cannot be. Within the limits where there are such.
pub fn inverse(robot: &RobotModel, wanted: &ToolGoal, from: &[f64]) -> Vec<f64> {
    let mut best: Option<(f64, Vec<f64>)> = None;
    for number in 0..=POSTURES {
        let start = if number == 0 {
            from.to_vec()
        } else {
            spread(robot, number)
        };
        let found = least_change(&mut Nominal::new(robot), wanted, &start, &start);
        let q = into_limits(robot, &found.q);
        let outside: f64 = (0..q.len())
            .map(|joint| excess(robot, joint, q[joint]))
            .sum();
        let cost = if found.residual + found.turn < REACHED {
            outside
        } else {
            1e3 * (1.0 + found.residual + found.turn) + outside
        };
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, q));
        }
        if cost == 0.0 {
            break;
        }
    }
    best.map_or_else(|| from.to_vec(), |(_, q)| q)
}

fn limits(robot: &RobotModel, joint: usize) -> [f64; 2] {
    let half = if robot.is_revolute(joint) { PI } else { 1.0 };
    robot.description().joints[joint]
        .limits
        .filter(|[a, b]| a.is_finite() && b.is_finite())
        .unwrap_or([-half, half])
}

/// Halton's sequence over the limits: the same postures everywhere.
pub(super) fn spread(robot: &RobotModel, number: u32) -> Vec<f64> {
    const PRIMES: [u32; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];
    let position = |joint: usize| {
        let base = PRIMES[joint % PRIMES.len()];
        let (mut remaining, mut digit, mut share) = (number, 1.0, 0.0);
        while remaining > 0 {
            digit /= f64::from(base);
            share += digit * f64::from(remaining % base);
            remaining /= base;
        }
        let [lower, upper] = limits(robot, joint);
        lower + share * (upper - lower)
    };
    (0..robot.joints()).map(position).collect()
}

/// Revolute joints turned by whole turns into their limits, where they are left.
pub(super) fn into_limits(robot: &RobotModel, q: &[f64]) -> Vec<f64> {
    let turned = |(joint, q): (usize, &f64)| {
        let [lower, upper] = limits(robot, joint);
        if !robot.is_revolute(joint) || (lower..=upper).contains(q) {
            return *q;
        }
        let middle = 0.5 * (lower + upper);
        q - TAU * ((q - middle) / TAU).round()
    };
    q.iter().enumerate().map(turned).collect()
}

/// How far a joint is beyond its limits.
pub(super) fn excess(robot: &RobotModel, joint: usize, q: f64) -> f64 {
    robot.description().joints[joint]
        .limits
        .map_or(0.0, |[lower, upper]| (lower - q).max(q - upper).max(0.0))
}
