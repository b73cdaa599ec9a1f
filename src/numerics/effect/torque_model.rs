//! What the torque model lacks: springs and hoses, masses of links and payload; seen through the joints' compliance (without one it moves
//! nothing).

use super::form::placed;
use super::summary::rounded;
use super::unknown::described;
use super::{
    ArmState, BeyondRange, Cause, Deflection, Form, Hypothesis, Measure, NumberSpec, OwnMotion,
    Place, Placed, Summary, Survey, Variable, names,
};
use crate::criteria::effect::{RARE, UNCOMMON};
use crate::robot::{LoadCorrection, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
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

/// A torque by the angle of a joint on top of gravity, as of a balancer's spring or a hose: periodic in the angle. Under the name of a cause.
///
/// Its torque is of first order where the spring's force is in proportion to its length; of second order too where it has a length at rest,
/// or is slack; of further orders where it is a strut on a short crank, or its pressure rises.
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

/// `link_mass`: mass (kg) and perhaps centre (first moments, kg m) of a link in the torque model are wrong; seen through compliance.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct WrongLinkMass {
    /// From 0.
    link: usize,
    /// Whether the centre is wrong too.
    centre: bool,
}

pub(super) static LINK_MASS: Cause = Cause {
    name: names::LINK_MASS,
    place: "link",
    formula: "mass and first moments of a link in the torque model",
    size: "3 to 20 %",
    confounded: "counterbalance, payload_error",
    needs: "link masses and motor currents",
    sentence: "the mass or centre of {place} in the torque model is wrong",
    measure: Some(MEASURE),
    motion: Some(OwnMotion {
        propose: WrongLinkMass::propose,
        sentence: None,
        read: Form::kept::<WrongLinkMass>,
    }),
    ..Cause::PLAIN
};

impl WrongLinkMass {
    /// Every link carried by a joint that yields in the present model.
    fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let carried = |link: &usize| (0..=*link).any(|joint| survey.compliance[joint] > 0.0);
        let body = |link: &usize| &survey.robot.description().joints[*link];
        let known = |link: &usize| body(link).mass.is_some() && body(link).centre.is_some();
        let links = (1..survey.joints()).filter(carried).filter(known);
        let forms =
            links.flat_map(|link| [false, true].map(|centre| WrongLinkMass { link, centre }));
        // What is off by more than half of a link is no error of its mass.
        let half = |form: &WrongLinkMass| 0.5 * body(&form.link).mass.unwrap_or(f64::INFINITY);
        forms
            .map(|form| Hypothesis {
                prior_penalty: *RARE,
                largest: half(&form),
                ..Hypothesis::new(form, 2)
            })
            .collect()
    }
}

impl Placed for WrongLinkMass {
    placed! { self: Place::Links(self.link, self.link), &LINK_MASS, [Variable::ArmLoad], self }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        mass_and_centre(
            (Unit::Kilogram, 1e4),
            (Unit::KilogramMetre, 1e4),
            self.centre,
        )
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        for joint in 0..=self.link {
            let mass = state.posture.torque_of_mass(robot, joint, self.link);
            let moment = || state.posture.torque_of_moment(robot, joint, self.link);
            load(joint, mass, self.centre.then(moment), out);
        }
    }

    fn load_correction(&self, _q: &[f64], _payload: f64, p: &[f64], out: &mut LoadCorrection) {
        out.body[self.link] += p[0];
        if self.centre {
            out.body_moment[self.link] += Vector3::new(p[1], p[2], p[3]);
        }
    }

    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        if Spring::balances(self.link) {
            vec![(names::COUNTERBALANCE, Place::Joint(self.link))]
        } else {
            Vec::new()
        }
    }

    fn is_of_torque_model(&self) -> bool {
        true
    }
}

/// The numbers of a wrong mass and, where that is wrong too, of its centre: unit and one sigma of each.
fn mass_and_centre(mass: (Unit, f64), of_axis: (Unit, f64), centre: bool) -> Vec<NumberSpec> {
    let spec = |name: &str, (unit, sigma): (Unit, f64)| (name.into(), unit, sigma);
    let axes = ["x", "y", "z"].map(|axis| spec(axis, of_axis));
    std::iter::once(spec("mass", mass))
        .chain(axes.into_iter().filter(|_| centre))
        .collect()
}

/// Loads a joint by a mass, Nm per unit of it, and perhaps by its first moments.
fn load(joint: usize, mass: f64, moment: Option<Vector3<f64>>, out: &mut Deflection) {
    out.load(0, joint, mass);
    for (axis, rate) in moment.iter().flatten().enumerate() {
        out.load(axis + 1, joint, *rate);
    }
}

/// `payload_error`: the payload's mass (and first moment) differs from what was declared, where one is carried.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct WrongPayload {
    /// Whether the centre is wrong too.
    centre: bool,
    /// Whether it is a mass at the tool that every row carries, in addition to the declared payload.
    #[serde(default)]
    tool: bool,
}

/// A tool of which nothing is known weighs this much, kg (one sigma), or as much as the heaviest declared payload.
const TOOL: f64 = 5.0;

pub(super) static PAYLOAD: Cause = Cause {
    name: names::PAYLOAD_ERROR,
    place: "tool",
    formula: "mass and centre of the payload, or an unstated mass at the tool, in the torque model",
    size: "3 to 30 %",
    confounded: "joint_hardening",
    needs: "rows with and without the payload",
    measure: Some(MEASURE),
    motion: Some(OwnMotion {
        propose: WrongPayload::propose,
        sentence: Some(declared_otherwise),
        read: Form::kept::<WrongPayload>,
    }),
    ..Cause::PLAIN
};

impl WrongPayload {
    fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let yields = survey.compliance.iter().any(|compliance| *compliance > 0.0);
        let forms = [false, true]
            .into_iter()
            .filter(|_| yields && survey.heavy_payload() > 0.0);
        let of = |centre, tool| Hypothesis::new(WrongPayload { centre, tool }, 2);
        let mut out: Vec<Hypothesis> = forms.map(|centre| of(centre, false)).collect();
        // Without any mass of the links nothing says how much of a wind-up is the tool's.
        let joints = &survey.robot.description().joints;
        if yields && joints.iter().any(|joint| joint.mass.is_some()) {
            out.push(of(false, true).penalised(*RARE));
        }
        out
    }
}

fn declared_otherwise(summary: &Summary) -> String {
    match summary.parameters.first() {
        // A tool's mass is its only form that loads an arm without a payload.
        Some(n)
            if summary
                .variables(names::PAYLOAD_ERROR)
                .contains(&Variable::ArmLoad) =>
        {
            let how = if n.value < 0.0 { "less" } else { "more" };
            format!(
                "the tool weighs {} kg {how} than the robot file and the payload say",
                rounded(n.value.abs(), n.sigma, 1)
            )
        }
        Some(n) => {
            let how = if n.value < 0.0 { "lighter" } else { "heavier" };
            format!(
                "the payload is {} % {how} than declared",
                rounded(n.value.abs() * 100.0, n.sigma.map(|sigma| 100.0 * sigma), 1)
            )
        }
        None => "the payload is not what was declared".to_string(),
    }
}

impl Placed for WrongPayload {
    placed! { self: Place::Tool, &PAYLOAD, [if self.tool { Variable::ArmLoad } else { Variable::Payload }], self }

    /// In shares of the declared payload, so that an empty flange stays empty.
    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec> {
        if self.tool {
            return vec![(
                "tool_mass".into(),
                Unit::Kilogram,
                TOOL.max(robot.description().payload_mass),
            )];
        }
        mass_and_centre((Unit::One, 1.0), (Unit::Millimetre, 1.0), self.centre)
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        let last = robot.joints() - 1;
        for joint in 0..=last {
            let carried = if self.tool {
                1.0
            } else {
                state.data.payload[state.row]
            };
            let mass = state.posture.torque_of_payload(robot, joint) * carried;
            let moment = || {
                state.posture.torque_of_moment(robot, joint, last) * state.data.payload[state.row]
            };
            load(joint, mass, self.centre.then(moment), out);
        }
    }

    fn load_correction(&self, _q: &[f64], payload: f64, p: &[f64], out: &mut LoadCorrection) {
        out.payload += p[0] * if self.tool { 1.0 } else { payload };
        if self.centre {
            out.payload_moment += Vector3::new(p[1], p[2], p[3]) * payload;
        }
    }

    fn is_of_torque_model(&self) -> bool {
        true
    }
}
