//! `counterbalance` (and `cable_drag`): a spring missing from the torque model; its torque is periodic in the joint's angle.
//!
//! Of first order where the spring's force goes with its length; of second order too where it has a length at rest, or is slack.
//! Balancers sit on joints 2 and 3; a torque by the angle of any other joint is that of a hose or cable. It is seen through the
//! joint's compliance: without one it moves nothing.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::{Burden, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Counterbalance {
    joint: usize,
    #[serde(default = "first")]
    orders: u32,
}

fn first() -> u32 {
    1
}

/// Orders of a spring that has a length at rest.
const ORDERS: u32 = 2;

impl Counterbalance {
    /// Every joint that yields in the present model.
    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| survey.yielding[*joint] > 0.0);
        let springs = joints.flat_map(|joint| (1..=ORDERS).map(move |orders| Self { joint, orders }));
        springs.map(|spring| Hypothesis::new(spring, ORDERS as usize).charged(2.0)).collect()
    }
}

impl Counterbalance {
    /// Sine and cosine of every order.
    fn waves(&self, q: &[f64]) -> impl Iterator<Item = f64> {
        let angle = q[self.joint];
        (1..=self.orders).flat_map(move |order| <[f64; 2]>::from(libm::sincos(f64::from(order) * angle)))
    }
}

impl Effect for Counterbalance {
    fn name(&self) -> &'static str {
        if (1..=2).contains(&self.joint) { "counterbalance" } else { "cable_drag" }
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let named = [
            ("sin", Unit::NewtonMetre, 1e5),
            ("cos", Unit::NewtonMetre, 1e5),
            ("sin2", Unit::NewtonMetre, 1e5),
            ("cos2", Unit::NewtonMetre, 1e5),
        ];
        parameters(self, named.into_iter().take(2 * self.orders as usize))
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        self.waves(state.q).enumerate().for_each(|(k, wave)| out.load(k, self.joint, wave));
    }

    fn needs_torque(&self) -> bool {
        true
    }

    fn burden(&self, q: &[f64], _payload: f64, p: &[f64], out: &mut Burden) {
        out.torque[self.joint] += self.waves(q).zip(p).map(|(wave, p)| wave * p).sum::<f64>();
    }
}

impl Placed for Counterbalance {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }
}
