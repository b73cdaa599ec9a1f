//! A torque by the angle of a joint on top of gravity, as of a balancer's spring or a hose: periodic in the angle, seen through the joint's
//! compliance (without one it moves nothing).
//!
//! Its torque is of first order where the spring's force is in proportion to its length; of second order too where it has a length at rest,
//! or is slack; of further orders where it is a strut on a short crank, or its pressure rises.

use super::form::placed;
use super::unknown::described;
use super::{
    ArmState, BeyondRange, Cause, Deflection, Form, Hypothesis, Measure, NumberSpec, OwnMotion,
    Place, Placed, Summary, Survey, Variable, names,
};
use crate::criteria::effect::UNCOMMON;
use crate::robot::{LoadCorrection, RobotModel};
use crate::units::Unit;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;

/// What separates the numbers of the torque model.
pub(super) const MEASURE: Measure = Measure {
    rank: 2,
    advice: "log motor currents at rest, or measure with two payloads over the joint's full range (for a balancer also disconnected)",
};

/// A balancer: it sits on joint 2 or 3; a torque by the angle of any other joint is that of a hose or cable.
pub(super) static BALANCER: Cause = Cause {
    name: names::COUNTERBALANCE,
    place: "joint 2 or 3",
    formula: "t = a sin q + b cos q, and of 2 q to 4 q, on top of gravity",
    size: "10 to 60 % of the gravity torque",
    confounded: "gear_cyclic of order 1, link_mass",
    needs: "link masses and motor currents",
    sentence: "a balancer (spring or gas) acts on {place} and is missing from the torque model",
    measure: Some(MEASURE),
    motion: Some(OwnMotion {
        propose: |survey| Spring::propose(&BALANCER, survey, Spring::balances),
        sentence: None,
        read: |body| Spring::read(&BALANCER, body),
    }),
    ..Cause::PLAIN
};

/// A hose package pulls on a joint by its angle, as a spring does; or by its own angle and its neighbour's, as a law without a name that is
/// called so.
pub(super) static HOSE: Cause = Cause {
    name: names::CABLE_DRAG,
    place: "joint",
    formula: "t by the angles of the joint and its neighbour",
    size: "1 to 10 % of the joint's torque",
    confounded: "unknown, gear_cyclic of order 1",
    needs: "motor currents",
    measure: Some(MEASURE),
    motion: Some(OwnMotion {
        propose: |survey| Spring::propose(&HOSE, survey, |joint| !Spring::balances(joint)),
        sentence: Some(pulled),
        read: |body| Spring::read(&HOSE, body),
    }),
    ..Cause::PLAIN
};

fn pulled(summary: &Summary) -> String {
    let place = summary.place;
    match described(summary) {
        Some(law) => format!("something pulls on {place} as a hose package does: {law}"),
        None => {
            format!(
                "a torque on {place} that depends on its angle, e.g. from a hose package, is missing from the torque model"
            )
        }
    }
}

/// Under the name of a cause.
#[derive(Clone)]
pub(super) struct Spring {
    cause: &'static Cause,
    shape: SpringShape,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct SpringShape {
    joint: usize,
    #[serde(default = "first")]
    orders: u32,
}

fn first() -> u32 {
    1
}

/// The highest order of a spring without a length at rest, of one that has it, and of a strut.
const ORDERS: [u32; 3] = [1, 2, 4];

impl Spring {
    /// At every joint that yields in the present model, of those for which `here` holds.
    pub fn propose(
        cause: &'static Cause,
        survey: &Survey,
        here: fn(usize) -> bool,
    ) -> Vec<Hypothesis> {
        let joints = survey
            .revolute()
            .filter(|joint| here(*joint) && survey.compliance[*joint] > 0.0);
        let springs = joints.flat_map(|joint| {
            ORDERS.map(move |orders| Self {
                cause,
                shape: SpringShape { joint, orders },
            })
        });
        springs
            .map(|spring| Hypothesis::new(spring, ORDERS.len()).penalised(*UNCOMMON))
            .collect()
    }

    /// Whether a joint (from 0) is one that balancers sit on.
    pub(crate) fn balances(joint: usize) -> bool {
        (1..=2).contains(&joint)
    }

    /// Reads the body of a form.
    pub fn read(cause: &'static Cause, body: &serde_json::Value) -> serde_json::Result<Form> {
        Ok(Self {
            cause,
            shape: SpringShape::deserialize(body)?,
        }
        .into())
    }

    /// Sine and cosine of every order.
    fn waves(&self, q: &[f64]) -> impl Iterator<Item = f64> {
        let angle = q[self.shape.joint];
        (1..=self.shape.orders)
            .flat_map(move |order| <[f64; 2]>::from(libm::sincos(f64::from(order) * angle)))
    }
}

impl Placed for Spring {
    placed! { self: Place::Joint(self.shape.joint), self.cause, [Variable::Angle { joint: self.shape.joint }], self.shape }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let order = |order: u32| {
            if order == 1 {
                String::new()
            } else {
                order.to_string()
            }
        };
        let names = (1..=self.shape.orders)
            .flat_map(|k| ["sin", "cos"].map(|name| format!("{name}{}", order(k))));
        names.map(|name| (name, Unit::NewtonMetre, 1e5)).collect()
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        self.waves(state.q)
            .enumerate()
            .for_each(|(k, wave)| out.load(k, self.shape.joint, wave));
    }

    /// Sine and cosine together are their size whatever the phase.
    fn beyond(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        _p: &[f64],
        within: &[Option<[f64; 2]>],
        out: &mut BeyondRange,
    ) -> Option<Variable> {
        let (variable, share) = self.most_beyond(robot, state, within)?;
        for k in 0..2 * self.shape.orders as usize {
            out.motions.load(k, self.shape.joint, FRAC_1_SQRT_2);
            out.close(share);
        }
        Some(variable)
    }

    fn load_correction(&self, q: &[f64], _payload: f64, p: &[f64], out: &mut LoadCorrection) {
        out.torque[self.shape.joint] += self.waves(q).zip(p).map(|(wave, p)| wave * p).sum::<f64>();
    }

    /// The torque of a link about its own joint is of first order in that joint's angle.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        let (joint, place) = (self.shape.joint, self.place());
        let balancer =
            (self.cause.name() == names::COUNTERBALANCE).then_some((names::CABLE_DRAG, place));
        balancer
            .into_iter()
            .chain([
                (names::GEAR_CYCLIC, place),
                (names::LINK_MASS, Place::Links(joint, joint)),
            ])
            .collect()
    }

    fn is_of_torque_model(&self) -> bool {
        true
    }
}
