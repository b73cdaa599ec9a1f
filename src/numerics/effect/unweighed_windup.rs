//! Wind-up under gravity of an arm whose masses nobody knows: d = sum_k c_k g . (axis x R_b e_k), with c_k = compliance times a first moment of
//! body b along e_k times g (rad). Stiffness and masses are one product.
//!
//! Bodies are those from the joint outwards, their moments base parameters: two a joint that turns. Bodies that slide are left out.

use super::form::placed;
use super::{
    ArmState, Cause, Deflection, Form, Hypothesis, NumberSpec, ParameterEstimate, Place, Placed,
    Survey, Variable, figure, names,
};
use crate::robot::{Measurements, Posture, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Under the name of a cause.
#[derive(Clone)]
pub(super) struct UnweighedWindup {
    cause: &'static Cause,
    shape: WindupShape,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct WindupShape {
    /// From 0.
    joint: usize,
    moments: Vec<Moment>,
    /// Whether gravity's torque is a function of the joint's own angle alone.
    #[serde(default)]
    own_angle: bool,
}

/// A direction in which a body has a first moment.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Moment {
    /// From 0.
    body: usize,
    /// Unit vector, zero-pose base axes.
    direction: [f64; 3],
    /// Whether it points to where the weight of such an arm hangs.
    #[serde(default)]
    outwards: bool,
}

/// Gravity loads a joint if it has so much of the lever that it has about a level axis.
const LEVER: f64 = 0.05;
/// Bodies with a smaller share of the largest moment, as the arm's lines have it, may hang anywhere.
const SLIGHT: f64 = 0.1;
/// The forms of one joint: bodies with and without moments across their lines.
const FORMS: usize = 3;
/// rad; one sigma of what is known.
const WIDE: f64 = 0.01;
/// rad, under the weight of one body at full stretch; the softest joints (20,000 Nm/rad under 200 Nm) yield as much.
const LARGEST: f64 = 0.01;

impl UnweighedWindup {
    /// Proposes wind-ups of every joint that gravity loads, from the weight of the next links alone to that of all; only where the robot file
    /// gives no mass.
    pub fn propose(cause: &'static Cause, survey: &Survey) -> Vec<Hypothesis> {
        if !is_unweighed(survey.robot) {
            return Vec::new();
        }
        let lines = moments(survey.robot);
        let postures: Vec<Posture> = survey
            .rows
            .iter()
            .map(|row| Posture::as_stated(survey.robot, survey.data.q(*row), 0.0))
            .collect();
        let loaded = survey
            .revolute()
            .filter(|joint| lever(survey.robot, *joint, &postures) > LEVER);
        loaded
            .flat_map(|joint| Self::at(cause, survey.robot, joint, &lines))
            .collect()
    }

    fn at(
        cause: &'static Cause,
        robot: &RobotModel,
        joint: usize,
        lines: &[Vector3<f64>],
    ) -> Vec<Hypothesis> {
        let most = lines[joint..]
            .iter()
            .map(|line| line.norm())
            .fold(0.0, f64::max);
        let bodies: Vec<usize> = (joint..robot.joints())
            .filter(|body| robot.is_revolute(*body))
            .collect();
        let heavy: Vec<usize> = bodies
            .iter()
            .copied()
            .filter(|body| lines[*body].norm() > SLIGHT * most)
            .collect();
        let own_angle = (0..joint).all(|before| is_plumb(robot, before));
        let outwards = |bodies: &[usize]| -> Vec<Moment> {
            bodies
                .iter()
                .map(|body| Moment::outwards(*body, lines))
                .collect()
        };
        let both = |bodies: &[usize]| -> Vec<Moment> {
            let pair = |body: &usize| {
                if heavy.contains(body) {
                    Moment::both(*body, robot, lines)
                } else {
                    Moment::any(*body, robot)
                }
            };
            bodies.iter().flat_map(pair).collect()
        };
        let mut all: Vec<(Vec<Moment>, bool)> = Vec::new();
        for count in 1..=heavy.len() {
            let first = &heavy[..count];
            all.extend([(outwards(first), true), (both(first), false)]);
        }
        all.push((both(&bodies), false));
        let mut out: Vec<Hypothesis> = Vec::new();
        for (moments, positive) in all.into_iter().filter(|(moments, _)| !moments.is_empty()) {
            let own_angle = own_angle && moments.iter().all(|moment| moment.body == joint);
            let form = Form::from(Self {
                cause,
                shape: WindupShape {
                    joint,
                    moments,
                    own_angle,
                },
            });
            if out.iter().any(|other| other.form == form) {
                continue;
            }
            out.push(Hypothesis {
                positive,
                ..Hypothesis::new(form, FORMS).within(LARGEST)
            });
        }
        out
    }

    /// Reads the body of a form, where it is one of these.
    pub fn read(
        cause: &'static Cause,
        body: &serde_json::Value,
    ) -> Option<serde_json::Result<Form>> {
        body.get("moments")?;
        Some(WindupShape::deserialize(body).map(|shape| Self { cause, shape }.into()))
    }

    /// The deflection (arcsec) with all its bodies level, with its standard deviation where that is known, as if the moments were
    /// independent.
    fn largest(&self, numbers: &[&ParameterEstimate]) -> String {
        let moments: Vec<(usize, f64, Option<f64>)> = self
            .shape
            .moments
            .iter()
            .zip(numbers)
            .map(|(moment, estimate)| (moment.body, estimate.value, estimate.sigma))
            .collect();
        let (mut size, mut variance) = (0.0, Some(0.0));
        for body in moments.chunk_by(|a, b| a.0 == b.0) {
            let length = body
                .iter()
                .map(|(_, value, _)| value * value)
                .sum::<f64>()
                .sqrt();
            size += length;
            for (_, value, sigma) in body {
                let share = if length > 0.0 { value / length } else { 1.0 };
                variance = variance
                    .zip(*sigma)
                    .map(|(sum, sigma)| sum + (share * sigma).powi(2));
            }
        }
        match variance {
            Some(variance) => format!("{} +- {}", figure(size, 0), figure(variance.sqrt(), 0)),
            None => figure(size, 0),
        }
    }
}

/// Whether a robot file gives no mass at all.
pub(super) fn is_unweighed(robot: &RobotModel) -> bool {
    robot
        .description()
        .joints
        .iter()
        .all(|joint| joint.mass.is_none() || joint.centre.is_none())
}

/// Whether a joint turns about gravity's own direction, wherever the joints before it stand.
fn is_plumb(robot: &RobotModel, joint: usize) -> bool {
    let down = Vector3::from(robot.description().gravity);
    !robot.is_revolute(joint) || robot.axis(joint).cross(&down).norm() < 1e-6 * down.norm()
}

/// The largest lever of a joint for gravity: 1 about a level axis.
fn lever(robot: &RobotModel, joint: usize, postures: &[Posture]) -> f64 {
    let of_posture = |posture: &Posture| {
        posture.torque_of_moment(robot, joint, joint).norm() / posture.gravity.norm()
    };
    postures
        .iter()
        .map(of_posture)
        .filter(|lever| lever.is_finite())
        .fold(0.0, f64::max)
}

/// Axes are parallel where the sine of their angle is below this: the foot of their common normal would be anywhere.
const PARALLEL: f64 = 0.1;

/// First moment of each body across the axis of its joint and about a point on that axis: zero-pose base axes, m2.
///
/// The weight of an arm of unknown masses hangs along the lines from joint to joint, from the feet of the axes' common normals to the tool,
/// every line as heavy as it is long. First moments are base parameters (Gautier and Khalil, 1990): what a body carries counts at the point
/// where it carries it, and a moment along the axis of a joint counts to the body before, which sees the same.
fn moments(robot: &RobotModel) -> Vec<Vector3<f64>> {
    let n = robot.joints();
    let knots = knots(robot);
    let mut moments = vec![Vector3::zeros(); n];
    let (mut carried, mut weight) = (Vector3::zeros(), 0.0);
    for body in (0..n).rev() {
        let line = knots[body + 1] - knots[body];
        let length = line.norm();
        let moment = line * (0.5 * length + weight) + carried;
        let axis = robot.axis(body);
        let along = axis * axis.dot(&moment);
        moments[body] = moment - along;
        carried = if robot.is_revolute(body) {
            along
        } else {
            moment
        };
        weight += length;
    }
    moments
}

/// Points from joint to joint and the tool, zero pose, m.
fn knots(robot: &RobotModel) -> Vec<Vector3<f64>> {
    let n = robot.joints();
    let mut knots = vec![robot.home().translation; n + 1];
    for joint in (0..n).rev() {
        let (axis, point) = (robot.axis(joint), robot.point(joint));
        let normal = (joint + 1 < n).then(|| axis.cross(robot.axis(joint + 1)));
        knots[joint] = match normal.filter(|normal| normal.norm() > PARALLEL) {
            Some(normal) => {
                let across = robot.axis(joint + 1).cross(&normal);
                point + axis * ((robot.point(joint + 1) - point).dot(&across) / axis.dot(&across))
            }
            None => point + axis * axis.dot(&(knots[joint + 1] - point)),
        };
    }
    knots
}

impl Moment {
    fn outwards(body: usize, lines: &[Vector3<f64>]) -> Self {
        Self {
            body,
            direction: lines[body].normalize().into(),
            outwards: true,
        }
    }

    /// Outwards, and across that and the axis.
    fn both(body: usize, robot: &RobotModel, lines: &[Vector3<f64>]) -> Vec<Self> {
        let across = robot.axis(body).cross(&lines[body]).normalize();
        vec![
            Self::outwards(body, lines),
            Self {
                body,
                direction: across.into(),
                outwards: false,
            },
        ]
    }

    fn any(body: usize, robot: &RobotModel) -> Vec<Self> {
        robot
            .normals(body)
            .iter()
            .map(|(_, normal)| Self {
                body,
                direction: (*normal).into(),
                outwards: false,
            })
            .collect()
    }
}

impl Placed for UnweighedWindup {
    placed! { self: Place::Joint(self.shape.joint), self.cause, [Variable::Load { joint: self.shape.joint }], self.shape }

    /// Moments beside the arm's lines, which are small: those along them are as large as links are heavy.
    fn of_one_size(&self) -> Vec<usize> {
        (0..self.shape.moments.len())
            .filter(|k| !self.shape.moments[*k].outwards)
            .collect()
    }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let mut names: Vec<String> = Vec::new();
        for Moment { body, outwards, .. } in &self.shape.moments {
            let first = format!("link{}", body + 1);
            let name = if *outwards || !names.contains(&first) {
                first
            } else {
                format!("{first}_across")
            };
            names.push(name);
        }
        names
            .into_iter()
            .map(|name| (name, Unit::Radian, WIDE))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let (joint, gravity) = (self.shape.joint, state.posture.gravity.norm());
        if gravity == 0.0 {
            return;
        }
        for (
            k,
            Moment {
                body, direction, ..
            },
        ) in self.shape.moments.iter().enumerate()
        {
            let torque = state
                .posture
                .torque_of_moment(robot, joint, *body)
                .dot(&Vector3::from(*direction));
            out.turn(k, p, joint, torque / gravity);
        }
    }

    fn missing(&self, robot: &RobotModel, _data: &Measurements) -> Option<String> {
        (Vector3::from(robot.description().gravity) == Vector3::zeros())
            .then(|| "the robot file gives no gravity".into())
    }

    fn variant(&self) -> String {
        "gravity".into()
    }

    /// An eccentric wheel, or a balancer, does the same as a weight about the first level axis.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        let names = [names::GEAR_CYCLIC, names::COUNTERBALANCE]
            .into_iter()
            .filter(|_| self.shape.own_angle);
        names.map(|name| (name, self.place())).collect()
    }

    fn words(&self, numbers: &[&ParameterEstimate]) -> Option<String> {
        Some(self.largest(numbers))
    }
}
