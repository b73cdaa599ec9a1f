//! `tool_offset`: the measured point sits elsewhere on the tool; three parameters, base axes at the zero pose.

use super::{ArmState, Deflection, Effect, ParameterSpec};
use crate::robot::RobotModel;
use crate::spatial::Twist;
use crate::units::Unit;

#[derive(Debug, Clone, Copy)]
pub struct ToolOffset;

impl Effect for ToolOffset {
    fn name(&self) -> &'static str {
        "tool_offset"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        ["x", "y", "z"]
            .iter()
            .map(|axis| ParameterSpec {
                name: format!("tool_offset.{axis}"),
                place: "tool".into(),
                unit: Unit::Millimetre,
                prior_sigma: 0.05,
            })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, _state: &ArmState, p: &[f64], out: &mut Deflection) {
        for axis in 0..3 {
            let mut twist = Twist::zeros();
            twist[axis] = 1.0;
            out.shift(axis, p, robot.joints(), twist);
        }
    }
}
