//! `link_mass`: mass (kg) and perhaps centre (first moments, kg m) of a link in the torque model are wrong; seen through compliance.

use super::form::placed;
use super::spring::{MEASURE, Spring};
use super::{
    ArmState, Cause, Deflection, Form, Hypothesis, NumberSpec, OwnMotion, Place, Placed, Survey,
    Variable, names,
};
use crate::criteria::effect::RARE;
use crate::robot::{LoadCorrection, RobotModel};
use crate::units::Unit;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct WrongLinkMass {
    /// From 0.
    link: usize,
    /// Whether the centre is wrong too.
    centre: bool,
}

pub(super) static CAUSE: Cause = Cause {
    name: names::LINK_MASS,
    place: "link",
    formula: "mass and first moments of a link in the torque model",
    size: "3 to 20 %",
    confounded: "counterbalance, payload_error",
    needs: "link masses and motor currents",
    sentence: "the mass or centre of {place} in the torque model is wrong",
    measure: Some(MEASURE),
    motion: Some(OwnMotion {
        propose,
        sentence: None,
        read: Form::kept::<WrongLinkMass>,
    }),
    ..Cause::PLAIN
};

/// Every link carried by a joint that yields in the present model.
fn propose(survey: &Survey) -> Vec<Hypothesis> {
    let carried = |link: &usize| (0..=*link).any(|joint| survey.compliance[joint] > 0.0);
    let body = |link: &usize| &survey.robot.description().joints[*link];
    let known = |link: &usize| body(link).mass.is_some() && body(link).centre.is_some();
    let links = (1..survey.joints()).filter(carried).filter(known);
    let forms = links.flat_map(|link| [false, true].map(|centre| WrongLinkMass { link, centre }));
    // What is off by more than half of a link is no error of its mass.
    let half = |form: &WrongLinkMass| 0.5 * body(&form.link).mass.unwrap_or(f64::INFINITY);
    forms
        .map(|form| (half(&form), form))
        .map(|(half, form)| Hypothesis::new(form, 2).penalised(*RARE).within(half))
        .collect()
}

impl Placed for WrongLinkMass {
    placed! { self: Place::Links(self.link, self.link), &CAUSE, [Variable::ArmLoad], self }

    fn numbers(&self, _robot: &RobotModel) -> Vec<NumberSpec> {
        let mass = ("mass".into(), Unit::Kilogram, 1e4);
        let moments = ["x", "y", "z"].map(|axis| (axis.into(), Unit::KilogramMetre, 1e4));
        std::iter::once(mass)
            .chain(moments.into_iter().filter(|_| self.centre))
            .collect()
    }

    fn deflect(&self, robot: &RobotModel, state: &ArmState, _p: &[f64], out: &mut Deflection) {
        for joint in 0..=self.link {
            out.load(
                0,
                joint,
                state.posture.torque_of_mass(robot, joint, self.link),
            );
            if self.centre {
                let torque = state.posture.torque_of_moment(robot, joint, self.link);
                for axis in 0..3 {
                    out.load(axis + 1, joint, torque[axis]);
                }
            }
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
