//! `counterbalance`: a spring missing from the torque model; its torque is periodic in the joint's angle.
//!
//! Of first order where the spring's force goes with its length; of second order too where it has a length at rest, or is slack.
//! Balancers sit on joints 2 and 3; a torque by the angle of any other joint is that of a hose or cable. It is seen through the
//! joint's compliance: without one it moves nothing.

use super::form::parameters;
use super::{
    About, ArmState, CableDrag, Cause, Deflection, Effect, Form, Hypothesis, Measure, ParameterSpec, Place, Placed, Survey, Told,
    Variable,
};
use crate::robot::{Burden, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};

pub struct Counterbalance;

/// What separates the numbers of the torque model.
pub(super) const MEASURE: Measure = Measure {
    rank: 2,
    advice: "log motor currents at rest, or measure with two payloads over the joint's full range (for a balancer also disconnected)",
};

/// A torque by the angle of a joint, of first order or of two.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Spring {
    joint: usize,
    #[serde(default = "first")]
    orders: u32,
}

fn first() -> u32 {
    1
}

/// Orders of a spring that has a length at rest.
const ORDERS: u32 = 2;

impl Cause for Counterbalance {
    fn about(&self) -> &'static About {
        &About {
            name: "counterbalance",
            place: "joint 2 or 3",
            formula: "t = a sin q + b cos q, and of 2 q, on top of gravity",
            size: "10 to 60 % of the gravity torque",
            confounded: "gear_cyclic of order 1, link_mass",
            needs: "link masses and motor currents",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        Spring::propose(survey, Spring::balances)
    }

    fn sentence(&self, told: &Told) -> String {
        format!("a balancer (spring or gas) acts on {} and is missing from the torque model", told.place)
    }

    fn finer(&self) -> &'static [&'static str] {
        CableDrag.finer()
    }

    /// The torque of a link about its own joint is of first order in that joint's angle, as a balancer's; a hose pulls by it too.
    fn identities(&self, form: &Form, _called: &str) -> Vec<(&'static str, Place)> {
        let mut out = vec![(CableDrag.name(), form.place()), ("gear_cyclic", form.place())];
        if let Place::Joint(joint) = form.place() {
            out.push(("link_mass", Place::Links(joint, joint)));
        }
        out
    }

    fn measure(&self) -> Option<Measure> {
        Some(MEASURE)
    }

    fn read(&self, body: &serde_json::Value) -> Option<serde_json::Result<Form>> {
        Some(Spring::deserialize(body).map(Form::from))
    }
}

impl Spring {
    /// At every joint that yields in the present model, of those for which `here` holds.
    pub(super) fn propose(survey: &Survey, here: fn(usize) -> bool) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| here(*joint) && survey.yielding[*joint] > 0.0);
        let springs = joints.flat_map(|joint| (1..=ORDERS).map(move |orders| Self { joint, orders }));
        springs.map(|spring| Hypothesis::new(spring, ORDERS as usize).charged(2.0)).collect()
    }

    /// Whether a joint (from 0) is one that balancers sit on.
    pub(super) fn balances(joint: usize) -> bool {
        (1..=2).contains(&joint)
    }

    /// Sine and cosine of every order.
    fn waves(&self, q: &[f64]) -> impl Iterator<Item = f64> {
        let angle = q[self.joint];
        (1..=self.orders).flat_map(move |order| <[f64; 2]>::from(libm::sincos(f64::from(order) * angle)))
    }
}

impl Effect for Spring {
    fn name(&self) -> &'static str {
        self.cause().name()
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

impl Placed for Spring {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn cause(&self) -> &'static dyn Cause {
        if Self::balances(self.joint) { &Counterbalance } else { &CableDrag }
    }

    fn variables(&self) -> Vec<Variable> {
        vec![Variable::Angle { joint: self.joint }]
    }

    fn is_of_torque_model(&self) -> bool {
        true
    }

    fn body(&self) -> serde_json::Value {
        serde_json::json!(self)
    }
}
