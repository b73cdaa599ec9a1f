//! The posture in which the deflected arm carries its loads.

use super::arm::{Arm, Posture};
use super::effect::{Physical, State};
use super::matrix::{self, Matrix, Vector};
use crate::arm::{Loads, Motion, Row};

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
            let memory = remembered(row, index);
            effect.act(
                &State {
                    arm,
                    row,
                    posture: &held.0,
                    loads: &held.1,
                    torque: &held.2,
                    memory,
                },
                &mut next,
            );
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
    let there = matrix::place(
        &matrix::times(&at_rest.motion.tracker, base),
        at_rest.posture.tool,
    );
    effects
        .iter()
        .enumerate()
        .fold(there, |point, (index, effect)| {
            effect.sight(row, remembered(row, index), point)
        })
}

fn remembered(row: &Row, effect: usize) -> f64 {
    row.memory.get(effect).copied().unwrap_or(0.0)
}

fn hold(arm: &Arm, row: &Row, motion: Motion) -> (Posture, Loads, Vec<f64>, Motion) {
    let angle: Vec<f64> = row
        .drive
        .iter()
        .zip(&motion.joint)
        .map(|(drive, extra)| drive + extra)
        .collect();
    let posture = arm.posture(&angle, &motion);
    let loads = Loads::new(arm, &posture, row.payload_kg);
    let gravity = loads.torques(arm, &posture);
    let torque = gravity
        .iter()
        .zip(&motion.load)
        .map(|(gravity, load)| gravity + load)
        .collect();
    (posture, loads, torque, motion)
}
