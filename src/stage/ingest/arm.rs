//! What ingest needs to know of the robot: number and kinds of joints, and their limits.

use crate::error::{Error, Result};
use crate::table::Robot;

/// The joints of the robot table.
pub(super) struct Arm {
    pub prismatic: Vec<bool>,
    /// Travel of each joint, rad or m.
    pub limits: Vec<[f64; 2]>,
}

impl Arm {
    pub(super) fn of(robot: &Robot) -> Result<Self> {
        let mut arm = Self { prismatic: Vec::new(), limits: Vec::new() };
        for row in &robot.0 {
            let (prismatic, lower, upper) = match row.kind.as_str() {
                "revolute" => (false, row.lower_rad, row.upper_rad),
                "prismatic" => (true, row.lower_mm.map(|mm| mm * 1e-3), row.upper_mm.map(|mm| mm * 1e-3)),
                _ => continue,
            };
            arm.prismatic.push(prismatic);
            arm.limits.push([lower.unwrap_or(f64::NEG_INFINITY), upper.unwrap_or(f64::INFINITY)]);
        }
        if arm.prismatic.is_empty() {
            return Err(Error::data("robot", "has no joint"));
        }
        Ok(arm)
    }
    pub(super) fn joints(&self) -> usize {
        self.prismatic.len()
    }
}
