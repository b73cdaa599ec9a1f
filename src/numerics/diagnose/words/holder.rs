//! A holder that slips round the flange: a target that steps about the last axis at constant radius, whichever name the step has.
//!
//! One target on the last body cannot separate a step of the last joint's zero from a displacement of the target about that axis.

use crate::criteria::words::CONSTANT;
use crate::diagnose::round::FitState;
use crate::diagnose::types::RivalCause;
use crate::effect::{Basis, Clock, Form, Place, ToolShift, Variable, ZeroShift, figure};
use crate::robot::{Measurements, Travel};
use nalgebra::Vector3;

/// A target that has turned about the last axis.
pub(super) struct HolderTurn {
    /// rad.
    angle: f64,
    /// After this time.
    at: f64,
    /// The last joint, from 0.
    joint: usize,
}

/// Whether a form is a step of the last joint's zero, or of the target on the tool; when.
pub(super) fn stepped(form: &Form, joints: usize) -> Option<f64> {
    let last = form.is(&ZeroShift) && form.place() == Place::Joint(joints - 1);
    let law = form.term().filter(|_| last || form.is(&ToolShift))?.law();
    match (law.first.of, law.first.basis) {
        (Variable::Time, Basis::After { at }) => Some(at),
        _ => None,
    }
}

impl HolderTurn {
    /// Of a finding that is made of such steps alone, in the fitted model.
    pub fn of(state: &FitState, data: &Measurements, forms: &[Form]) -> Option<Self> {
        let (robot, rows) = (&state.model.robot, &state.screening.kept);
        let joints = robot.joints();
        if joints < 2 || !robot.is_revolute(joints - 1) {
            return None;
        }
        let times = forms.iter().map(|form| stepped(form, joints)).collect::<Option<Vec<f64>>>()?;
        let (first, last) = times.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), at| (a.min(*at), b.max(*at)));
        let before = *rows.iter().find(|row| data.time(**row) <= first)?;
        let after = *rows.iter().find(|row| data.time(**row) > last && data.target(**row) == data.target(before))?;
        let [from, to] = [before, after].map(|row| seat(state, data, row));
        let axis = robot.axis(joints - 1);
        let [along, radius] = [(to - from).dot(axis), axis.cross(&to).norm() - axis.cross(&from).norm()];
        let moved = (to - from).norm();
        let angle = axis.dot(&from.cross(&to)).atan2(axis.cross(&from).dot(&axis.cross(&to)));
        let constant = along.abs().max(radius.abs()) < *CONSTANT * moved;
        constant.then_some(Self { angle, at: first, joint: joints - 1 })
    }

    pub fn sentence(&self, clock: Clock, rms: &str) -> String {
        let joint = Place::Joint(self.joint);
        format!(
            "the holder has turned by {} deg about the flange{}, its target at constant radius; a step in the zero of {joint} would look the \
             same ({rms} rms at the tool).",
            figure(self.angle.to_degrees().abs(), 2),
            clock.since(self.at)
        )
    }

    /// The other name of what is called `effect`.
    pub fn rival(&self, effect: &str) -> RivalCause {
        let zero = (ZeroShift::NAME, Place::Joint(self.joint));
        let (effect, place) = if effect == ZeroShift::NAME { (ToolShift::NAME, Place::Tool) } else { zero };
        RivalCause { effect, place, delta_bic: 0.0, probability: 0.0 }
    }
}

/// Where a row's target sits from a point on the last axis, m, zero pose, if the last joint stood where it was commanded.
fn seat(state: &FitState, data: &Measurements, row: usize) -> Vector3<f64> {
    let (model, robot) = (&state.model, &state.model.robot);
    let last = robot.joints() - 1;
    let motion = model.stack.point_motion(robot, data, row, &model.x, &mut model.stack.scratch(robot));
    let commanded = motion.posture.behind[last] * robot.motion(last, &Travel::new(data.q(row)[last]));
    commanded.inverse_point(&motion.point) - robot.point(last)
}
