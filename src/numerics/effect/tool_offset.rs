//! `tool_offset`: the measured point sits elsewhere on the tool; three parameters a target, base axes at the zero pose.
//!
//! Where its orientation is measured too, three more turn a target about where it is mounted.

use super::{ArmState, Deflection, Effect, ParameterSpec, Place, names};
use crate::robot::{RobotModel, Target};
use crate::spatial::{Twist, screw};
use crate::units::Unit;
use nalgebra::Vector3;

/// Where the measured point sits on the tool.
#[derive(Debug, Clone, Copy)]
pub struct ToolOffset;

const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// How many parameters a target has.
fn width(target: &Target) -> usize {
    if target.oriented { 6 } else { 3 }
}

impl ToolOffset {
    /// What the names of a target's parameters begin with, dot included.
    pub fn prefix(target: &str) -> String {
        if target.is_empty() {
            format!("{}.", names::TOOL_OFFSET)
        } else {
            format!("{}.{target}.", names::TOOL_OFFSET)
        }
    }
}

impl Effect for ToolOffset {
    fn name(&self) -> &'static str {
        names::TOOL_OFFSET
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let targets: Vec<(&str, usize)> = match robot.setup().targets.as_slice() {
            [] => vec![("", 3)],
            targets => targets
                .iter()
                .map(|target| (target.name.as_str(), width(target)))
                .collect(),
        };
        let all = targets.into_iter().flat_map(|(name, width)| {
            AXES[..width]
                .iter()
                .enumerate()
                .map(move |(k, axis)| ParameterSpec {
                    name: format!("{}{axis}", Self::prefix(name)),
                    place: Place::Tool,
                    unit: if k < 3 {
                        Unit::Millimetre
                    } else {
                        Unit::Radian
                    },
                    prior_sigma: 0.05,
                })
        });
        all.collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let targets = &robot.setup().targets;
        let number = state.target(robot);
        if number.is_none() && !targets.is_empty() {
            return;
        }
        let first: usize = targets
            .iter()
            .take(number.unwrap_or_default())
            .map(width)
            .sum();
        for axis in 0..3 {
            let mut twist = Twist::zeros();
            twist[axis] = 1.0;
            out.shift(first + axis, p, robot.joints(), twist);
        }
        if let Some(target) = number
            .and_then(|number| targets.get(number))
            .filter(|target| target.oriented)
        {
            for axis in 0..3 {
                let turn = screw(&Vector3::ith(axis, 1.0), &target.mounting.translation);
                out.shift(first + 3 + axis, p, robot.joints(), turn);
            }
        }
    }
}
