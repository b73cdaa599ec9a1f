//! `axis_wobble`: the axis of a joint tilts as the joint turns; sines and cosines of an order in two directions.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::spatial::screw;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AxisWobble {
    joint: usize,
    order: u32,
}

/// No bearing lets an axis tilt further, rad (100 arcsec).
const LARGEST: f64 = 5e-4;

impl AxisWobble {
    /// Every joint but the last, whose tilt one measured point cannot tell from its angle.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let last = survey.joints() - 1;
        let forms = survey.revolute().filter(|joint| *joint != last).flat_map(|joint| [1, 2].map(|order| Self { joint, order }));
        forms.map(|form| Hypothesis::new(form, 2).charged(4.0).within(LARGEST)).collect()
    }
}

impl Effect for AxisWobble {
    fn name(&self) -> &'static str {
        "axis_wobble"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        parameters(self, ["a_sin", "a_cos", "b_sin", "b_cos"].map(|name| (name, Unit::Radian, 0.01)))
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let (sine, cosine) = libm::sincos(f64::from(self.order) * state.q[self.joint]);
        for (k, (_, normal)) in robot.normals(self.joint).iter().enumerate() {
            let tilt = screw(normal, robot.point(self.joint));
            out.shift(2 * k, p, self.joint + 1, tilt * sine);
            out.shift(2 * k + 1, p, self.joint + 1, tilt * cosine);
        }
    }
}

impl Placed for AxisWobble {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn variant(&self) -> String {
        format!("order{}", self.order)
    }
}
