//! Inverse kinematics of the nominal robot: Newton's method from a given posture, then from others spread over the limits.

use super::solve::{Nominal, ToolGoal, least_change};
use crate::robot::RobotModel;
use std::f64::consts::{PI, TAU};

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
        let q: Vec<f64> = found
            .q
            .iter()
            .enumerate()
            .map(|(joint, q)| into_limits(robot, joint, *q))
            .collect();
        let outside: f64 = q
            .iter()
            .enumerate()
            .map(|(joint, q)| excess(robot, joint, *q))
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
        let (mut rest, mut digit, mut share) = (number, 1.0, 0.0);
        while rest > 0 {
            digit /= f64::from(base);
            share += digit * f64::from(rest % base);
            rest /= base;
        }
        let [lower, upper] = limits(robot, joint);
        lower + share * (upper - lower)
    };
    (0..robot.joints()).map(position).collect()
}

/// A revolute joint turned by whole turns into its limits, where they are left.
pub(super) fn into_limits(robot: &RobotModel, joint: usize, q: f64) -> f64 {
    let [lower, upper] = limits(robot, joint);
    if !robot.is_revolute(joint) || (lower..=upper).contains(&q) {
        return q;
    }
    let middle = 0.5 * (lower + upper);
    q - TAU * ((q - middle) / TAU).round()
}

pub(super) fn excess(robot: &RobotModel, joint: usize, q: f64) -> f64 {
    robot.description().joints[joint]
        .limits
        .map_or(0.0, |[lower, upper]| (lower - q).max(q - upper).max(0.0))
}
