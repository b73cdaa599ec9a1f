//! `base_compliance`: the foundation tilts about the base origin, or a point below it, under the arm's overturning moment; rad/Nm.

use super::form::placed;
use super::{
    ArmState, Cause, Deflection, Form, Hypothesis, NumberSpec, OwnMotion, Place, Placed, Survey,
    Variable, names,
};
use crate::criteria::effect::STIFFNESS_BEYOND;
use crate::robot::RobotModel;
use crate::spatial::screw;
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct TiltingBase {
    /// Two stiffnesses instead of one.
    two: bool,
    /// How far the point about which it tilts is below the base origin, m: pedestals and floors yield underneath.
    #[serde(default)]
    below: f64,
}

/// Depths that are tried first, m, how far the next are from them, and the deepest.
const DEPTHS: [f64; 2] = [0.0, 0.6];
const STEP: f64 = 0.3;
const DEEPEST: f64 = 3.0;

pub(super) static CAUSE: Cause = Cause {
    name: names::BASE_COMPLIANCE,
    place: "base",
    formula: "the base tilts about its origin, or a point below, by the moment on it",
    size: "0.01 to 1 urad/Nm",
    confounded: "joint_compliance of joint 2, link_compliance of link 1",
    needs: "link masses",
    sentence: "the base tilts under the arm's weight by {value}",
    motion: Some(OwnMotion {
        propose,
        sentence: None,
        read: Form::kept::<TiltingBase>,
    }),
    ..Cause::PLAIN
};

fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let loaded = (0..survey.joints()).any(|joint| survey.is_loaded(joint));
    let forms = DEPTHS
        .into_iter()
        .filter(|_| loaded)
        .flat_map(|below| [false, true].map(|two| TiltingBase { two, below }));
    forms
        .map(|form| Hypothesis::new(form, 2 * DEPTHS.len()).positive())
        .collect()
}

impl TiltingBase {
    /// The point about which it tilts, m, and the moment about that, Nm.
    fn moment(&self, robot: &RobotModel, state: &ArmState) -> (Vector3<f64>, Vector3<f64>) {
        let down = Vector3::from(robot.description().gravity);
        let pivot = down.try_normalize(0.0).unwrap_or_default() * self.below;
        (pivot, state.posture.moment(0, &pivot))
    }
}

impl Placed for TiltingBase {
    placed! { self: Place::Base, &CAUSE, [Variable::ArmLoad], self }

    /// The first link bends as the base tilts.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        vec![(names::LINK_COMPLIANCE, Place::Links(0, 0))]
    }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let names: &[&str] = if self.two { &["x", "y"] } else { &[""] };
        names
            .iter()
            .map(|name| (name.to_string(), Unit::RadianPerNewtonMetre, 1e-3))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let down = Vector3::from(robot.description().gravity);
        let (pivot, moment) = self.moment(robot, state);
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        // The two base axes that gravity has least of.
        let vertical = axes
            .iter()
            .enumerate()
            .max_by(|a, b| down.dot(a.1).abs().total_cmp(&down.dot(b.1).abs()));
        let vertical = vertical.map_or(2, |(axis, _)| axis);
        for (k, axis) in (0..3).filter(|axis| *axis != vertical).enumerate() {
            let tilt = screw(&(axes[axis] * moment[axis]), &pivot);
            out.shift(if self.two { k } else { 0 }, p, 0, tilt);
        }
    }

    fn sizes(&self, robot: &RobotModel, state: &ArmState) -> Vec<Option<f64>> {
        vec![Some(self.moment(robot, state).1.norm())]
    }

    fn doubt(&self) -> f64 {
        *STIFFNESS_BEYOND
    }

    fn near(&self, _survey: &Survey, level: i32) -> Vec<Form> {
        let step = STEP * libm::exp2(-0.7 * f64::from(level));
        let depths = [self.below - step, self.below + step].map(|below| below.clamp(0.0, DEEPEST));
        depths
            .into_iter()
            .filter(|below| *below != self.below)
            .map(|below| {
                Self {
                    two: self.two,
                    below,
                }
                .into()
            })
            .collect()
    }
}
