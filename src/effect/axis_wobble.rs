//! `axis_wobble`: the axis of a joint tilts as the joint turns; sines and cosines of an order in one plane or two, which stand in the
//! link before the joint (an outer ring that is not round) or turn with the joint (an inner one).

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
    /// The direction across the axis (0 or 1) about which it tilts; both if none.
    about: Option<usize>,
    /// Whether the plane turns with the joint.
    turning: bool,
}

/// No bearing lets an axis tilt further, rad (100 arcsec).
const LARGEST: f64 = 5e-4;

impl AxisWobble {
    /// Every joint but the last, whose tilt one measured point cannot tell from its angle.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let last = survey.joints() - 1;
        let forms = survey.revolute().filter(|joint| *joint != last).flat_map(|joint| {
            let orders = [1, 2].into_iter().flat_map(|order| [(order, true), (order, false)]);
            orders.flat_map(move |(order, turning)| [None, Some(0), Some(1)].map(|about| Self { joint, order, about, turning }))
        });
        forms.map(|form| Hypothesis::new(form, 12).charged(4.0).within(LARGEST)).collect()
    }
}

impl Effect for AxisWobble {
    fn name(&self) -> &'static str {
        "axis_wobble"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let names = [["a_sin", "a_cos"], ["b_sin", "b_cos"]];
        let chosen = (0..2).filter(|k| self.about.is_none_or(|about| about == *k)).flat_map(|k| names[k]);
        parameters(self, chosen.map(|name| (name, Unit::Radian, 0.01)))
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let (sine, cosine) = libm::sincos(f64::from(self.order) * state.q[self.joint]);
        let normals = robot.normals(self.joint).iter().enumerate();
        let station = if self.turning { self.joint + 1 } else { self.joint };
        let chosen = normals.filter(|(k, _)| self.about.is_none_or(|about| about == *k)).map(|(_, normal)| normal);
        for (k, (_, normal)) in chosen.enumerate() {
            let tilt = screw(normal, robot.point(self.joint));
            out.shift(2 * k, p, station, tilt * sine);
            out.shift(2 * k + 1, p, station, tilt * cosine);
        }
    }
}

impl Placed for AxisWobble {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn variant(&self) -> String {
        format!("order{}{}", self.order, if self.turning { "" } else { "_fixed" })
    }
}
