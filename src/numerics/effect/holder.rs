//! A holder that slips round the flange: a target that steps about the last axis at constant radius, whichever name the step has.
//!
//! One target on the last body cannot separate a step of the last joint's zero from a displacement of the target about that axis.

use super::{Basis, Clock, FittedForms, Form, ModelledFinding, Place, Variable, figure, names};
use crate::criteria::words::CONSTANT;
use crate::robot::Travel;
use nalgebra::Vector3;

/// Whether a form is a step of the last joint's zero, or of the target on the tool; when.
fn stepped(form: &Form, joints: usize) -> Option<f64> {
    let last = form.name() == names::ZERO_SHIFT && form.place() == Place::Joint(joints - 1);
    let law = form
        .term()
        .filter(|_| last || form.name() == names::TOOL_SHIFT)?
        .law();
    match (law.first.variable, law.first.basis) {
        (Variable::Time, Basis::After { at }) => Some(at),
        _ => None,
    }
}

/// A finding that is made of such steps alone, as a turn of the holder.
pub fn turned_holder(fitted: &FittedForms) -> Option<ModelledFinding> {
    let FittedForms {
        robot, data, rows, ..
    } = *fitted;
    let joints = robot.joints();
    if joints < 2 || !robot.is_revolute(joints - 1) {
        return None;
    }
    let times = fitted
        .forms
        .iter()
        .map(|form| stepped(form, joints))
        .collect::<Option<Vec<f64>>>()?;
    let (first, last) = times
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| {
            (a.min(*at), b.max(*at))
        });
    let before = *rows.iter().find(|row| data.time(**row) <= first)?;
    let after = *rows
        .iter()
        .find(|row| data.time(**row) > last && data.target(**row) == data.target(before))?;
    let [from, to] = [before, after].map(|row| off_the_axis(fitted, row));
    let axis = robot.axis(joints - 1);
    let [along, radius] = [
        (to - from).dot(axis),
        axis.cross(&to).norm() - axis.cross(&from).norm(),
    ];
    let moved = (to - from).norm();
    if along.abs().max(radius.abs()) >= *CONSTANT * moved {
        return None;
    }
    let angle = axis
        .dot(&from.cross(&to))
        .atan2(axis.cross(&from).dot(&axis.cross(&to)));
    let joint = Place::Joint(joints - 1);
    let sentence = format!(
        "the holder has turned by {} deg about the flange{}, its target at constant radius; a step in the zero of {joint} would look the same",
        figure(angle.to_degrees().abs(), 2),
        Clock::of(data).since(first)
    );
    let is_zero = fitted.called == names::ZERO_SHIFT;
    let same = if is_zero {
        (names::TOOL_SHIFT, Place::Tool)
    } else {
        (names::ZERO_SHIFT, joint)
    };
    Some(ModelledFinding { sentence, same })
}

/// Where a row's target is from a point on the last axis, m, zero pose, if the last joint stood where it was commanded.
fn off_the_axis(fitted: &FittedForms, row: usize) -> Vector3<f64> {
    let FittedForms {
        robot,
        stack,
        x,
        data,
        ..
    } = *fitted;
    let last = robot.joints() - 1;
    let motion = stack.point_motion(robot, data, row, x, &mut stack.scratch(robot));
    let commanded =
        motion.posture.behind[last] * robot.motion(last, &Travel::new(data.q(row)[last]));
    commanded.inverse_point(&motion.point) - robot.point(last)
}
