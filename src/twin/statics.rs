//! Statics: forces and moments summed over bodies.

use super::arm::{Arm, Posture};
use super::matrix::{self, Vector};

/// Bodies with weight, in the base frame: the link that carries it (the payload: one past the last), mass in kg, centre.
#[derive(Debug, Clone)]
pub(crate) struct Loads {
    bodies: Vec<(usize, f64, Vector)>,
    gravity: Vector,
}

impl Loads {
    /// The links and the declared payload (kg) of an arm in `posture`.
    pub(crate) fn new(arm: &Arm, posture: &Posture, payload: f64) -> Loads {
        let mut bodies: Vec<(usize, f64, Vector)> =
            (arm.links.iter().zip(&posture.frames).enumerate())
                .map(|(index, (link, frame))| (index, link.mass, matrix::place(frame, link.centre)))
                .collect();
        if let Some(hand) = posture.frames.last() {
            // Beyond the last link: it bends that link too.
            bodies.push((
                arm.links.len(),
                payload * arm.payload_share,
                matrix::place(hand, arm.payload_centre),
            ));
        }
        Loads {
            bodies,
            gravity: arm.gravity,
        }
    }

    /// Force (N) and moment about `point` (Nm) of the weight of everything from link `from` (from 0) on, base frame.
    pub(crate) fn wrench(&self, from: usize, point: Vector) -> (Vector, Vector) {
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for (_, mass, centre) in self.bodies.iter().filter(|(link, _, _)| *link >= from) {
            let weight = matrix::scale(self.gravity, *mass);
            force = matrix::add(force, weight);
            moment = matrix::add(moment, matrix::cross(matrix::minus(*centre, point), weight));
        }
        (force, moment)
    }

    /// What gravity does to each joint along its axis, Nm (N for a prismatic joint).
    pub(crate) fn torques(&self, arm: &Arm, posture: &Posture) -> Vec<f64> {
        let joints = arm
            .links
            .iter()
            .zip(&posture.frames)
            .zip(&posture.axes)
            .enumerate();
        joints
            .map(|(index, ((link, frame), axis))| {
                let (force, moment) = self.wrench(index, matrix::origin(frame));
                matrix::dot(*axis, if link.revolute { moment } else { force })
            })
            .collect()
    }
}

/// What holds in one row besides the loads.
#[derive(Debug, Clone)]
pub struct Row {
    /// Joint positions that the controller reports, rad or m.
    pub command: Vec<f64>,
    /// Joint positions at the gears' outputs without load, rad or m.
    pub drive: Vec<f64>,
    /// +1, -1 or 0: last move of each joint.
    pub direction: Vec<f64>,
    /// s.
    pub time_s: f64,
    /// C.
    pub temperature_c: f64,
    /// Declared, kg.
    pub payload_kg: f64,
    /// Velocity of each joint, rad/s or m/s; empty where the arm stands.
    pub velocity: Vec<f64>,
    /// What each effect that acts makes of the rows before, in the order of the effects; empty: they make nothing of them.
    pub memory: Vec<f64>,
}
