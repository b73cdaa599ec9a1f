//! Where the model was measured, and whether a command leaves that or the joint limits.

use super::arm::Circumstance;
use crate::description::RobotDescription;
use crate::robot::{Measurements, Unmeasured, Visited};

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage(Visited);

impl Coverage {
    /// The coverage of a recording.
    pub fn of(data: &Measurements) -> Self {
        Self(Visited::of(data, &(0..data.rows()).collect::<Vec<_>>()))
    }

    /// What of a command was never measured; empty inside.
    pub fn beyond(&self, q: &[f64], circumstance: &Circumstance) -> Vec<Unmeasured> {
        self.0
            .beyond(q, circumstance.payload, circumstance.temperature)
    }
}

/// The joints, from 0, that a command takes out of their limits.
pub(crate) fn beyond_limits(robot: &RobotDescription, q: &[f64]) -> Vec<usize> {
    let limits = robot.joints.iter().map(|joint| joint.limits);
    let outside = |q: f64, limits: Option<[f64; 2]>| {
        limits.is_some_and(|[lower, upper]| q < lower || q > upper)
    };
    (0..)
        .zip(q.iter().zip(limits))
        .filter(|(_, (q, limits))| outside(**q, *limits))
        .map(|(joint, _)| joint)
        .collect()
}
