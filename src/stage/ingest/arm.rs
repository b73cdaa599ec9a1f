//! What ingest needs to know of the robot: number and kinds of joints, and their limits.

use super::slots::Slots;
use crate::error::{Error, Result};
use crate::table::Robot;

/// The joints of the robot table.
pub(super) struct RobotJoints {
    /// Names of the joints; none where no robot is known.
    pub names: Vec<String>,
    pub prismatic: Vec<bool>,
    /// Travel of each joint, rad or m.
    pub limits: Vec<[f64; 2]>,
    /// The layout of its rows.
    pub slots: Slots,
}

impl RobotJoints {
    pub(super) fn of(robot: &Robot) -> Result<Self> {
        let (mut names, mut kinds, mut limits) = (Vec::new(), Vec::new(), Vec::new());
        for row in &robot.0 {
            let (prismatic, lower, upper) = match row.kind.as_str() {
                "revolute" => (false, row.lower_rad, row.upper_rad),
                "prismatic" => (
                    true,
                    row.lower_mm.map(|mm| mm * 1e-3),
                    row.upper_mm.map(|mm| mm * 1e-3),
                ),
                _ => continue,
            };
            names.push(row.name.clone());
            kinds.push(prismatic);
            limits.push([
                lower.unwrap_or(f64::NEG_INFINITY),
                upper.unwrap_or(f64::INFINITY),
            ]);
        }
        if kinds.is_empty() {
            return Err(Error::data("robot", "has no joint"));
        }
        Ok(Self {
            names,
            ..Self::new(kinds, limits)
        })
    }
    pub(super) fn new(prismatic: Vec<bool>, limits: Vec<[f64; 2]>) -> Self {
        Self {
            names: Vec::new(),
            slots: Slots::new(prismatic.len()),
            prismatic,
            limits,
        }
    }
    /// A joint (from 0) at `value`, rad or m, beyond which limit it is, in deg or mm.
    pub(super) fn beyond(&self, joint: usize, value: f64) -> String {
        let [lower, upper] = self
            .limits
            .get(joint)
            .copied()
            .unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let prismatic = self.prismatic.get(joint) == Some(&true);
        let (scale, unit) = if prismatic {
            (1e3, "mm")
        } else {
            (1f64.to_degrees(), "deg")
        };
        let (side, limit) = if value < lower {
            ("below its lower", lower)
        } else {
            ("above its upper", upper)
        };
        let name = self
            .names
            .get(joint)
            .map(|name| format!(" (`{name}`)"))
            .unwrap_or_default();
        let (number, value, limit) = (joint + 1, value * scale, limit * scale);
        format!("joint {number}{name} at {value:.4} {unit}, {side} limit of {limit:.4} {unit}")
    }
    pub(super) fn joints(&self) -> usize {
        self.prismatic.len()
    }
}
