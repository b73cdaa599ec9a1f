//! What yields in proportion to its load: joints, links, the base.

use super::form::placed;
use super::motion::{SHORT, extent};
use super::unweighed_windup::UnweighedWindup;
use super::{
    ArmState, Cause, Deflection, Effect, EffectContext, Form, Hypothesis, Load, NumberSpec,
    OwnMotion, ParameterSpec, Place, Placed, Summary, Survey, Variable, names, tolerance,
};
use crate::criteria::effect::{RARE, STIFFNESS_BEYOND, UNLIKELY};
use crate::description::Made;
use crate::robot::{Measurements, RobotModel};
use crate::spatial::{Twist, screw};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

pub(super) static JOINT: Cause = Cause {
    name: names::JOINT_COMPLIANCE,
    place: "joint",
    formula: "d = c t",
    size: "0.1 to 10 urad/Nm",
    confounded: "joint_hardening, reduction_ratio, link_compliance; without masses gear_cyclic of order 1",
    needs: "link masses, motor currents, or many postures",
    arm_effect: Some(of_all_joints),
    motion: Some(OwnMotion {
        propose: Windup::propose,
        sentence: Some(wound_up),
        read: |body| {
            UnweighedWindup::read(&JOINT, body).unwrap_or_else(|| Form::kept::<Windup>(body))
        },
    }),
    ..Cause::PLAIN
};

fn wound_up(summary: &Summary) -> String {
    let place = summary.place;
    let Some(largest) = summary.words(names::JOINT_COMPLIANCE) else {
        return format!("{place} winds up under its load by {}", summary.value());
    };
    let weight = format!("by up to {largest} arcsec where its links stretch out level");
    // By a stiffness of its own.
    match summary.wordless(names::JOINT_COMPLIANCE).first() {
        Some(estimate) => format!(
            "{place} winds up under its load by {:.3e} {}, and under its own weight, which the robot file does not give, {weight}",
            estimate.value, estimate.unit
        ),
        None => format!(
            "{place} winds up under gravity, {weight}; its stiffness cannot be separated from the links' weight, which the robot file does \
             not give"
        ),
    }
}

/// `joint_compliance`: a joint winds up in proportion to its load (Eqs. 25-30); the wind-up of one joint.
///
/// The load is the gravity torque from the robot's masses (rad/Nm) or the motor current (rad/A), see [`Load`]; where nobody knows the
/// masses, gravity's torque per first moment, see [`UnweighedWindup`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Windup {
    load: Load,
    /// From 0.
    joint: usize,
}

impl Placed for Windup {
    placed! { self: Place::Joint(self.joint), &JOINT, [Variable::Load { joint: self.joint }], self }

    fn numbers(&self, robot: &RobotModel) -> Vec<NumberSpec> {
        let tolerance = match self.load {
            Load::GravityTorque => tolerance(robot, Made::Compliance),
            Load::MotorCurrent => 1e-3,
        };
        vec![(String::new(), self.load.unit_of_compliance(), tolerance)]
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        self.wind_up(0, state, p, out);
    }

    fn sizes(&self, _robot: &RobotModel, state: &ArmState) -> Vec<Option<f64>> {
        vec![Some(self.load_of(state))]
    }

    fn doubt(&self) -> f64 {
        *STIFFNESS_BEYOND
    }

    fn needs_torque(&self) -> bool {
        self.load == Load::GravityTorque
    }

    fn needs_current(&self) -> bool {
        self.load == Load::MotorCurrent
    }

    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        match self.load {
            Load::MotorCurrent if data.current.is_none() => {
                Some("the recording has no motor currents".into())
            }
            Load::GravityTorque
                if !robot.has_masses() && data.payload.iter().all(|mass| *mass == 0.0) =>
            {
                Some("the robot file gives no link masses and no row carries a payload".into())
            }
            _ => None,
        }
    }

    fn compliance(&self, p: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint, *p.first()?))
    }
}

impl Windup {
    /// Every joint that gravity loads; where the robot file has no masses to make a torque from, by motor currents and by gravity alone.
    fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let of = |load: Load, tried| move |joint| Hypothesis::new(Windup { joint, load }, tried);
        let loaded = survey.revolute().filter(|joint| survey.is_loaded(*joint));
        let by_gravity = loaded
            .map(of(Load::GravityTorque, 1))
            .map(Hypothesis::positive);
        let by_current = !survey.robot.has_masses() && survey.data.current.is_some();
        // The sign of a current is the controller's.
        let currents = survey.revolute().filter(|_| by_current);
        by_gravity
            .chain(currents.map(of(Load::MotorCurrent, 2)))
            .chain(UnweighedWindup::propose(&JOINT, survey))
            .collect()
    }

    /// Nm or A.
    fn load_of(&self, state: &ArmState) -> f64 {
        match self.load {
            Load::GravityTorque => state.posture.torque[self.joint],
            Load::MotorCurrent => match state.current().map(|all| all[self.joint]) {
                Some(current) if current.is_finite() => current,
                _ => 0.0,
            },
        }
    }

    /// Adds the turn of its joint by coefficient number `parameter` of `p`.
    fn wind_up(&self, parameter: usize, state: &ArmState, p: &[f64], out: &mut Deflection) {
        out.turn(parameter, p, self.joint, self.load_of(state));
        if self.load == Load::GravityTorque {
            out.yields(self.joint, p[parameter]);
        }
    }
}

/// The wind-ups of every joint that turns.
struct Windups(Load);

fn of_all_joints(setting: &EffectContext) -> Box<dyn Effect> {
    Box::new(Windups(setting.load))
}

impl Windups {
    fn each(&self, robot: &RobotModel) -> impl Iterator<Item = Windup> {
        let load = self.0;
        (0..robot.joints())
            .filter(|joint| robot.is_revolute(*joint))
            .map(move |joint| Windup { load, joint })
    }
}

impl Effect for Windups {
    fn name(&self) -> &'static str {
        names::JOINT_COMPLIANCE
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        self.each(robot)
            .flat_map(|windup| Form::from(windup).parameters(robot))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        self.each(robot)
            .enumerate()
            .for_each(|(parameter, windup)| windup.wind_up(parameter, state, p, out));
    }

    fn needs_torque(&self) -> bool {
        self.0 == Load::GravityTorque
    }

    fn needs_current(&self) -> bool {
        self.0 == Load::MotorCurrent
    }

    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        Windup {
            load: self.0,
            joint: 0,
        }
        .missing(robot, data)
    }
}

/// Compliances of what the arm's moment bends, by their names.
fn compliances(names: &[&str]) -> Vec<NumberSpec> {
    let one = |name: &&str| (name.to_string(), Unit::RadianPerNewtonMetre, 1e-3);
    names.iter().map(one).collect()
}

/// Which moments bend the link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Bending {
    /// Those across the link, at its middle: a joint within it.
    AcrossLink,
    /// Those across the link at each of its places: a beam that does not twist.
    Beam,
    /// Those across and along the link at each of its places, alike: a tube.
    Tube,
    /// Those across the axis that moves it: what the joint's own compliance does not show.
    AcrossAxis,
    /// Two stiffnesses across that axis.
    TwoDirections,
}

/// `link_compliance`: link N bends under the moment of all that it carries, all along as a beam or at its middle; rad/Nm.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BentLink {
    /// From 0.
    link: usize,
    bending: Bending,
}

/// The last links are a stubby wrist, and hardly bend.
const WRIST: usize = 2;

pub(super) static LINK: Cause = Cause {
    name: names::LINK_COMPLIANCE,
    place: "link",
    formula: "the link bends by the moment at each of its places, as a uniform beam",
    size: "0.05 to 1 urad/Nm",
    confounded: "joint_compliance of either end",
    needs: "link masses",
    sentence: "{place} bends under what it carries by {value}",
    motion: Some(OwnMotion {
        propose: BentLink::propose,
        sentence: None,
        read: Form::kept::<BentLink>,
    }),
    ..Cause::PLAIN
};

impl BentLink {
    /// Every link that something hangs on.
    fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let n = survey.joints();
        let loaded = (0..n).any(|joint| survey.is_loaded(joint));
        let bendings = [
            Bending::Beam,
            Bending::Tube,
            Bending::AcrossLink,
            Bending::AcrossAxis,
            Bending::TwoDirections,
        ];
        let links = (0..n - 1).filter(|link| loaded && extent(survey.robot, *link).norm() > SHORT);
        let forms = links.flat_map(|link| bendings.map(|bending| BentLink { link, bending }));
        let odds = |form: &BentLink| {
            if form.link + WRIST >= n {
                *UNLIKELY
            } else {
                *RARE
            }
        };
        forms
            .map(|form| Hypothesis {
                positive: true,
                prior_penalty: odds(&form),
                ..Hypothesis::new(form, bendings.len())
            })
            .collect()
    }

    /// A place on the link, m, at a share of its length, and the moment about that, Nm.
    fn moment(
        &self,
        robot: &RobotModel,
        state: &ArmState,
        share: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let place = robot.point(self.link) + extent(robot, self.link) * share;
        (place, state.posture.moment(self.link + 1, &place))
    }

    /// What the moments at all places of the link turn beyond it by a unit, without those along `direction`. The moment is linear along the
    /// link, the motion that it makes quadratic: Simpson's rule is exact.
    fn beam(&self, robot: &RobotModel, state: &ArmState, without: Option<&Vector3<f64>>) -> Twist {
        let at = |share: f64| {
            let (place, moment) = self.moment(robot, state, share);
            let along = without.map_or_else(Vector3::zeros, |direction| {
                direction * direction.dot(&moment)
            });
            screw(&(moment - along), &place)
        };
        (at(0.0) + at(0.5) * 4.0 + at(1.0)) / 6.0
    }
}

impl Placed for BentLink {
    placed! { self: Place::Links(self.link, self.link), &LINK, [Variable::ArmLoad], self }

    /// What carries the first joint's link is the base.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        if self.link == 0 {
            vec![(names::BASE_COMPLIANCE, Place::Base)]
        } else {
            Vec::new()
        }
    }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        compliances(match self.bending {
            Bending::TwoDirections => &["first", "second"],
            _ => &[""],
        })
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let along = extent(robot, self.link);
        let station = self.link + 1;
        let (middle, moment) = self.moment(robot, state, 0.5);
        let without = |direction: &Vector3<f64>| moment - direction * direction.dot(&moment);
        let bent = match self.bending {
            Bending::AcrossLink => screw(&without(&along.normalize()), &middle),
            Bending::Beam => self.beam(robot, state, Some(&along.normalize())),
            Bending::Tube => self.beam(robot, state, None),
            Bending::AcrossAxis => screw(&without(robot.axis(self.link)), &middle),
            Bending::TwoDirections => {
                for (k, (_, normal)) in robot.normals(self.link).iter().enumerate() {
                    let across = screw(&(normal * normal.dot(&moment)), &middle);
                    out.shift(k, p, station, across);
                }
                return;
            }
        };
        out.shift(0, p, station, bent);
    }

    fn sizes(&self, robot: &RobotModel, state: &ArmState) -> Vec<Option<f64>> {
        vec![Some(self.moment(robot, state, 0.5).1.norm())]
    }

    fn doubt(&self) -> f64 {
        *STIFFNESS_BEYOND
    }
}

/// `base_compliance`: the foundation tilts about the base origin, or a point below it, under the arm's overturning moment; rad/Nm.
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

pub(super) static BASE: Cause = Cause {
    name: names::BASE_COMPLIANCE,
    place: "base",
    formula: "the base tilts about its origin, or a point below, by the moment on it",
    size: "0.01 to 1 urad/Nm",
    confounded: "joint_compliance of joint 2, link_compliance of link 1",
    needs: "link masses",
    sentence: "the base tilts under the arm's weight by {value}",
    motion: Some(OwnMotion {
        propose: TiltingBase::propose,
        sentence: None,
        read: Form::kept::<TiltingBase>,
    }),
    ..Cause::PLAIN
};

impl TiltingBase {
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

    /// The point about which it tilts, m, and the moment about that, Nm.
    fn moment(&self, robot: &RobotModel, state: &ArmState) -> (Vector3<f64>, Vector3<f64>) {
        let down = Vector3::from(robot.description().gravity);
        let pivot = down.try_normalize(0.0).unwrap_or_default() * self.below;
        (pivot, state.posture.moment(0, &pivot))
    }
}

impl Placed for TiltingBase {
    placed! { self: Place::Base, &BASE, [Variable::ArmLoad], self }

    /// The first link bends as the base tilts.
    fn identities(&self, _called: &str) -> Vec<(&'static str, Place)> {
        vec![(names::LINK_COMPLIANCE, Place::Links(0, 0))]
    }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        compliances(if self.two { &["x", "y"] } else { &[""] })
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
