//! The model that the user's simulation has: the nominal robot, aligned, with the corrections that every calibration makes.

use crate::effect::{Effect, EffectContext, EffectStack, Load, identified, names};
use crate::estimate::{Model, align};
use crate::robot::{Measurements, RobotModel};

/// Effects that the user's simulation has.
pub const BASE: [&str; 6] = [
    names::BASE_FRAME,
    names::TOOL_OFFSET,
    names::JOINT_OFFSET,
    names::LINK_GEOMETRY,
    names::REDUCTION_RATIO,
    names::COUPLING_RATIO,
];

/// The base model at its start, less the corrections that the user excludes.
pub(super) fn base_model(
    robot: &RobotModel,
    data: &Measurements,
    rows: &[usize],
    without: &[String],
) -> Model {
    let setting = EffectContext {
        base: align(robot, data, rows),
        load: Load::GravityTorque,
    };
    let effects: Vec<Box<dyn Effect>> = identified()
        .filter(|cause| {
            BASE.contains(&cause.name())
                || (cause.name() == names::ANCHOR && !robot.setup().anchors.is_empty())
        })
        .filter(|cause| !without.iter().any(|name| name == cause.name()))
        .filter_map(|cause| cause.arm_effect(&setting))
        .filter(|effect| effect.missing(robot, data).is_none())
        .collect();
    Model::nominal(
        robot.clone(),
        EffectStack::new(robot, setting.base, effects),
    )
}
