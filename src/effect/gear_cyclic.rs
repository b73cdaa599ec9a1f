//! `gear_cyclic`: transmission or encoder error periodic in the joint angle; a sine and a cosine for each order per joint turn.

use super::form::parameters;
use super::{ArmState, Deflection, Effect, Hypothesis, ParameterSpec, Place, Placed, Survey};
use crate::robot::RobotModel;
use crate::units::Unit;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GearCyclic {
    joint: usize,
    order: u32,
}

/// Orders per joint turn that are tried: strain wave gears and absolute encoders show some twenty, worm wheels more.
const ORDERS: u32 = 48;
/// An order needs this much of its phase (rad) within the joint's travel to be more than a line.
const PHASE: f64 = 2.2;
/// Eccentricity makes the lowest orders on any joint; they are tried as a few, all others as many.
const LOW: u32 = 4;

impl GearCyclic {
    pub fn new(joint: usize, order: u32) -> Self {
        Self { joint, order }
    }

    pub fn joint(&self) -> usize {
        self.joint
    }

    pub fn order(&self) -> u32 {
        self.order
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute();
        let forms = joints.flat_map(|joint| {
            let orders = (1..=ORDERS).filter(move |order| f64::from(*order) * survey.travel(joint) > PHASE);
            orders.map(move |order| Hypothesis::new(Self { joint, order }, if order > LOW { ORDERS as usize } else { 6 }))
        });
        forms.collect()
    }
}

impl Effect for GearCyclic {
    fn name(&self) -> &'static str {
        "gear_cyclic"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        parameters(self, [("sin", Unit::Radian, 0.01), ("cos", Unit::Radian, 0.01)])
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        let (sine, cosine) = libm::sincos(f64::from(self.order) * state.q[self.joint]);
        out.turn(0, p, self.joint, sine);
        out.turn(1, p, self.joint, cosine);
    }
}

impl Placed for GearCyclic {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn variant(&self) -> String {
        format!("order{}", self.order)
    }
}
