//! `joint_compliance`: a joint winds up in proportion to its load (Eqs. 25-30); one parameter a revolute joint.
//!
//! The load is the gravity torque from the robot's masses (rad/Nm) or the motor current (rad/A), see [`Load`]; where nobody knows the
//! masses, gravity's torque per first moment, see [`UnweighedWindup`].

use super::form::placed;
use super::unweighed_windup::UnweighedWindup;
use super::{
    ArmState, Cause, Deflection, Effect, EffectContext, Form, Hypothesis, Load, NumberSpec,
    OwnMotion, ParameterSpec, Place, Placed, Summary, Survey, Variable, names,
};
use crate::criteria::effect::STIFFNESS_BEYOND;
use crate::robot::{Measurements, RobotModel};
use serde::{Deserialize, Serialize};

pub(super) static CAUSE: Cause = Cause {
    name: names::JOINT_COMPLIANCE,
    place: "joint",
    formula: "d = c t",
    size: "0.1 to 10 urad/Nm",
    confounded: "joint_hardening, reduction_ratio, link_compliance; without masses gear_cyclic of order 1",
    needs: "link masses, motor currents, or many postures",
    arm_effect: Some(of_all_joints),
    motion: Some(OwnMotion {
        propose,
        sentence: Some(sentence),
        read: |body| {
            UnweighedWindup::read(&CAUSE, body).unwrap_or_else(|| Form::kept::<Windup>(body))
        },
    }),
    ..Cause::PLAIN
};

/// Every joint that gravity loads; where the robot file has no masses to make a torque from, by motor currents and by gravity alone.
fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let by_gravity = survey.revolute().filter(|joint| survey.is_loaded(*joint));
    let by_gravity = by_gravity.map(|joint| {
        Hypothesis::new(
            Windup {
                joint,
                load: Load::GravityTorque,
            },
            1,
        )
        .positive()
    });
    let by_current = !survey.robot.has_masses() && survey.data.current.is_some();
    // The sign of a current is the controller's.
    let currents = survey.revolute().filter(|_| by_current);
    let currents = currents.map(|joint| {
        Hypothesis::new(
            Windup {
                joint,
                load: Load::MotorCurrent,
            },
            2,
        )
    });
    by_gravity
        .chain(currents)
        .chain(UnweighedWindup::propose(&CAUSE, survey))
        .collect()
}

fn sentence(summary: &Summary) -> String {
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

/// The wind-up of one joint.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Windup {
    load: Load,
    /// From 0.
    joint: usize,
}

impl Placed for Windup {
    placed! { self: Place::Joint(self.joint), &CAUSE, [Variable::Load { joint: self.joint }], self }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let prior_sigma = match self.load {
            Load::GravityTorque => 1e-3,
            Load::MotorCurrent => 1e-2,
        };
        vec![(String::new(), self.load.unit_of_compliance(), prior_sigma)]
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
    /// Nm or A.
    fn load_of(&self, state: &ArmState) -> f64 {
        match self.load {
            Load::GravityTorque => state.torque()[self.joint],
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
