//! `joint_compliance`: a joint winds up in proportion to its load (Eqs. 25-30); one parameter a revolute joint.
//!
//! The load is the gravity torque from the robot's masses (rad/Nm) or the motor current (rad/A), see [`Load`]; where nobody knows the
//! masses, gravity's torque per first moment, see [`UnweighedWindup`].

use super::unweighed_windup::UnweighedWindup;
use super::{
    ArmState, Cause, CauseDescription, Deflection, Effect, EffectContext, Form, Hypothesis, Load, ParameterSpec, Place, Placed,
    Summary, Survey, Variable, names,
};
use crate::robot::{Measurements, RobotModel};
use serde::{Deserialize, Serialize};

/// Wind-up of joints by their load.
pub struct JointCompliance;

impl Cause for JointCompliance {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: names::JOINT_COMPLIANCE,
            place: "joint",
            formula: "d = c t",
            size: "0.1 to 10 urad/Nm",
            confounded: "joint_hardening, reduction_ratio, link_compliance; without masses gear_cyclic of order 1",
            needs: "link masses, motor currents, or many postures",
        }
    }

    fn whole(&self, setting: &EffectContext) -> Option<Box<dyn Effect>> {
        Some(Box::new(Windup::new(setting.load)))
    }

    /// Every joint that gravity loads; where the robot file has no masses to make a torque from, by motor currents and by gravity alone.
    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let by_gravity = survey.revolute().filter(|joint| survey.is_loaded(*joint));
        let by_gravity = by_gravity.map(|joint| Hypothesis::new(Windup::of(joint, Load::GravityTorque), 1).positive());
        let by_current = !survey.robot.has_masses() && survey.data.current.is_some();
        // The sign of a current is the controller's.
        let currents = survey.revolute().filter(|_| by_current);
        let currents = currents.map(|joint| Hypothesis::new(Windup::of(joint, Load::MotorCurrent), 2));
        by_gravity.chain(currents).chain(UnweighedWindup::propose(&Self, survey)).collect()
    }

    fn sentence(&self, summary: &Summary) -> String {
        let place = summary.place;
        let Some(weight) = UnweighedWindup::size(summary) else {
            return format!("{place} winds up under its load by {}", summary.value());
        };
        match summary.of_form::<Windup>().next() {
            Some(own) => format!(
                "{place} winds up under its load by {:.3e} {}, and under its own weight, which the robot file does not give, {weight}",
                own.value, own.unit
            ),
            None => format!(
                "{place} winds up under gravity, {weight}; its stiffness cannot be separated from the links' weight, which the robot file does \
                 not give"
            ),
        }
    }

    fn absorbs_residual(&self) -> &'static [&'static str] {
        &[names::UNKNOWN]
    }

    fn read(&self, body: &serde_json::Value) -> Option<serde_json::Result<Form>> {
        UnweighedWindup::read(&Self, body).or_else(|| Some(Windup::deserialize(body).map(Form::from)))
    }

    fn identities(&self, form: &Form, _called: &str) -> Vec<(&'static str, Place)> {
        UnweighedWindup::identities(form)
    }

    fn yields_to_torque(&self) -> bool {
        true
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Windup {
    load: Load,
    /// One joint (from 0), or all that turn.
    joint: Option<usize>,
}

impl Windup {
    /// Of every joint that turns.
    pub fn new(load: Load) -> Self {
        Self { load, joint: None }
    }

    /// Of one joint, from 0.
    pub fn of(joint: usize, load: Load) -> Self {
        Self { load, joint: Some(joint) }
    }

    fn joints(&self, robot: &RobotModel) -> impl Iterator<Item = usize> {
        let one = self.joint;
        (0..robot.joints()).filter(move |j| one.is_none_or(|joint| joint == *j)).filter(|j| robot.is_revolute(*j))
    }
}

impl Effect for Windup {
    fn name(&self) -> &'static str {
        names::JOINT_COMPLIANCE
    }

    fn parameters(&self, robot: &RobotModel) -> Vec<ParameterSpec> {
        let unit = self.load.unit_of_compliance();
        let prior_sigma = match self.load {
            Load::GravityTorque => 1e-3,
            Load::MotorCurrent => 1e-2,
        };
        self.joints(robot)
            .map(|j| ParameterSpec { name: format!("joint_compliance.j{}", j + 1), place: Place::Joint(j), unit, prior_sigma })
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for (parameter, joint) in self.joints(robot).enumerate() {
            let load = match self.load {
                Load::GravityTorque => state.torque()[joint],
                Load::MotorCurrent => match state.current().map(|all| all[joint]) {
                    Some(current) if current.is_finite() => current,
                    _ => 0.0,
                },
            };
            out.turn(parameter, p, joint, load);
            if self.load == Load::GravityTorque {
                out.yields(joint, p[parameter]);
            }
        }
    }

    fn needs_torque(&self) -> bool {
        self.load == Load::GravityTorque
    }

    fn needs_current(&self) -> bool {
        self.load == Load::MotorCurrent
    }

    fn missing(&self, robot: &RobotModel, data: &Measurements) -> Option<String> {
        match self.load {
            Load::MotorCurrent if data.current.is_none() => Some("the recording has no motor currents".into()),
            Load::GravityTorque if !robot.has_masses() && data.payload.iter().all(|mass| *mass == 0.0) => {
                Some("the robot file gives no link masses and no row carries a payload".into())
            }
            _ => None,
        }
    }
}

impl Placed for Windup {
    fn place(&self) -> Place {
        Place::Joint(self.joint.unwrap_or(0))
    }

    fn cause(&self) -> &'static dyn Cause {
        &JointCompliance
    }

    fn variables(&self) -> Vec<Variable> {
        vec![Variable::Load { joint: self.joint.unwrap_or(0) }]
    }

    fn compliance(&self, p: &[f64]) -> Option<(usize, f64)> {
        Some((self.joint?, *p.first()?))
    }

    fn body(&self) -> serde_json::Value {
        serde_json::json!(self)
    }
}
