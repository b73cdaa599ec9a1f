//! The model that the user's simulation has: the nominal robot, aligned, with the corrections that every calibration makes.

use super::reversed_joints::{REVERSED, reverse, reversed};
use crate::effect::{Effect, EffectContext, EffectStack, Load, Place, ReductionRatio, identified};
use crate::estimate::{Model, align};
use crate::robot::{Measurements, RobotModel};

/// Effects that the user's simulation has.
pub const BASE: [&str; 6] = ["base_frame", "tool_offset", "joint_offset", "link_geometry", "reduction_ratio", "coupling_ratio"];

/// The base model at its start.
pub(super) fn base_model(robot: &RobotModel, data: &Measurements, rows: &[usize]) -> Model {
    let reversed = reversed(robot, data, rows);
    let mut turned = data.clone();
    reversed.iter().for_each(|joint| reverse(&mut turned, *joint));
    let setting = EffectContext { base: align(robot, &turned, rows), load: Load::GravityTorque };
    let effects: Vec<Box<dyn Effect>> = identified()
        .filter(|cause| BASE.contains(&cause.name()))
        .filter_map(|cause| cause.whole(&setting))
        .filter(|effect| effect.missing(robot, data).is_none())
        .collect();
    let mut model = Model::nominal(robot.clone(), EffectStack::new(robot, setting.base, effects));
    for joint in reversed {
        let stack = &model.stack;
        let ratio = stack.parameters_of(ReductionRatio::NAME).find(|k| stack.specs()[*k].place == Place::Joint(joint));
        if let Some(k) = ratio {
            model.x[k] = REVERSED;
        }
    }
    model
}
