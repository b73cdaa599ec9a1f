//! Numbers that leave the robot file by more than manufacture errs: lengths by 2 %, angles by 2 deg, ratios by 1 %.

use crate::criteria::setup::{CLEARLY, LENGTH, RATIO, SHORT};
use crate::diagnose::round::FitState;
use crate::effect::{Place, figure, names};
use crate::estimate::ParameterStatus;
use crate::robot::RobotModel;
use crate::units::Unit;
use std::f64::consts::PI;

/// rad.
pub(super) const ANGLE: f64 = 2.0 * PI / 180.0;

/// How far an axis may stand from where the robot file has it beyond the link that joint `joint` (from 0) moves, m.
pub(super) fn length_error(robot: &RobotModel, joint: usize, reach: f64) -> f64 {
    let next = (joint + 1).min(robot.joints() - 1);
    (*LENGTH * (robot.point(next) - robot.point(joint)).norm()).max(*SHORT * reach)
}

/// Numbers of the identified base model that are beyond, each with its size.
pub(super) fn beyond(now: &FitState, robot: &RobotModel, reach: f64) -> Vec<String> {
    let mut out = Vec::new();
    let specs = now.model.stack.specs();
    for (effect, range) in now.model.stack.effects() {
        for k in range {
            let ParameterStatus::Free(sigma) = now.fitted.statuses[k] else {
                continue;
            };
            let (spec, value) = (&specs[k], now.model.x[k]);
            let limit = match (effect.name(), spec.place, spec.unit) {
                (names::LINK_GEOMETRY, Place::Links(link, _), Unit::Millimetre) => {
                    length_error(robot, link, reach)
                }
                (names::LINK_GEOMETRY | names::JOINT_OFFSET, _, Unit::Radian) => ANGLE,
                (names::REDUCTION_RATIO, ..) => *RATIO,
                _ => continue,
            };
            if value.abs() > limit + *CLEARLY * sigma {
                out.push(match spec.unit {
                    Unit::Radian => {
                        format!("{} by {} deg", spec.name, figure(value.to_degrees(), 1))
                    }
                    Unit::Millimetre => format!("{} by {} mm", spec.name, figure(value * 1e3, 1)),
                    _ => format!("{} by {} %", spec.name, figure(value * 100.0, 1)),
                });
            }
        }
    }
    out
}
