//! Where the model was measured, and whether a command leaves that or the joint limits.

use super::arm::Circumstance;
use crate::robot::description::RobotDescription;
use crate::robot::{Measurements, Visited, listed};

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage(Visited);

impl Coverage {
    pub fn of(data: &Measurements) -> Self {
        Self(Visited::of(data, &(0..data.rows()).collect::<Vec<_>>()))
    }

    /// What of a command was never measured, in words; empty inside.
    pub fn beyond(&self, q: &[f64], circumstance: &Circumstance) -> Vec<String> {
        self.0.beyond(q, circumstance.payload, circumstance.temperature)
    }
}

/// The joints that a command takes out of their limits, in words.
pub(crate) fn beyond_limits(robot: &RobotDescription, q: &[f64]) -> Option<String> {
    let limits = robot.joints.iter().map(|joint| joint.limits);
    let outside = |q: f64, limits: Option<[f64; 2]>| limits.is_some_and(|[lower, upper]| q < lower || q > upper);
    listed(
        (1..).zip(q.iter().zip(limits)).filter(|(_, (q, limits))| outside(**q, *limits)).map(|(joint, _)| joint),
        "beyond its limits",
    )
}
