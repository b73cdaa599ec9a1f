//! What ingest needs to know of the robot: number and kinds of joints, and their limits.

use super::slots::Slots;
use crate::error::{Error, Result};
use crate::table::Robot;

/// The joints of the robot table.
pub(super) struct RobotJoints {
    pub prismatic: Vec<bool>,
    /// Travel of each joint, rad or m.
    pub limits: Vec<[f64; 2]>,
    /// The layout of its rows.
    pub slots: Slots,
}

impl RobotJoints {
    pub(super) fn of(robot: &Robot) -> Result<Self> {
        let (mut kinds, mut limits) = (Vec::new(), Vec::new());
        for row in &robot.0 {
            let (prismatic, lower, upper) = match row.kind.as_str() {
                "revolute" => (false, row.lower_rad, row.upper_rad),
                "prismatic" => (true, row.lower_mm.map(|mm| mm * 1e-3), row.upper_mm.map(|mm| mm * 1e-3)),
                _ => continue,
            };
            kinds.push(prismatic);
            limits.push([lower.unwrap_or(f64::NEG_INFINITY), upper.unwrap_or(f64::INFINITY)]);
        }
        if kinds.is_empty() {
            return Err(Error::data("robot", "has no joint"));
        }
        Ok(Self::new(kinds, limits))
    }
    pub(super) fn new(prismatic: Vec<bool>, limits: Vec<[f64; 2]>) -> Self {
        Self { slots: Slots::new(prismatic.len()), prismatic, limits }
    }
    pub(super) fn joints(&self) -> usize {
        self.prismatic.len()
    }
}
