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
    /// With twice the order, as an eccentric wheel or disc has it.
    #[serde(default)]
    overtone: bool,
}

/// Orders per joint turn that are tried: strain wave gears and absolute encoders show some twenty, worm wheels more.
const ORDERS: u32 = 48;
/// An order needs this much of its phase (rad) within the joint's travel to be more than a line.
const PHASE: f64 = 2.2;
/// Eccentricity makes the lowest orders on any joint; they are tried as a few, all others as many.
const LOW: u32 = 4;
/// A wheel far off its centre is rarer than one slightly off: -2 ln of the odds.
const OVERTONE: f64 = 2.0;

impl GearCyclic {
    pub fn new(joint: usize, order: u32) -> Self {
        Self { joint, order, overtone: false }
    }

    pub fn joint(&self) -> usize {
        self.joint
    }

    pub fn order(&self) -> u32 {
        self.order
    }

    /// Whether twice the order belongs to it.
    pub fn has_overtone(&self) -> bool {
        self.overtone
    }

    pub fn propose(survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute();
        let forms = joints.flat_map(|joint| {
            let orders = (1..=ORDERS).filter(move |order| f64::from(*order) * survey.travel(joint) > PHASE);
            orders.flat_map(move |order| {
                let pure = Hypothesis::new(Self::new(joint, order), if order > LOW { ORDERS as usize } else { 6 });
                let wheel = (order <= LOW).then(|| Hypothesis::new(Self { joint, order, overtone: true }, 6).charged(OVERTONE));
                [Some(pure), wheel].into_iter().flatten()
            })
        });
        forms.collect()
    }
}

impl Effect for GearCyclic {
    fn name(&self) -> &'static str {
        "gear_cyclic"
    }

    fn parameters(&self, _robot: &RobotModel) -> Vec<ParameterSpec> {
        let numbers = ["sin", "cos", "sin_overtone", "cos_overtone"].map(|name| (name, Unit::Radian, 0.01));
        parameters(self, numbers.into_iter().take(if self.overtone { 4 } else { 2 }))
    }

    fn deflect(&self, _robot: &RobotModel, state: &ArmState, p: &[f64], out: &mut Deflection) {
        for k in 0..=usize::from(self.overtone) {
            let (sine, cosine) = libm::sincos((k + 1) as f64 * f64::from(self.order) * state.q[self.joint]);
            out.turn(2 * k, p, self.joint, sine);
            out.turn(2 * k + 1, p, self.joint, cosine);
        }
    }
}

impl Placed for GearCyclic {
    fn place(&self) -> Place {
        Place::Joint(self.joint)
    }

    fn variant(&self) -> String {
        if self.overtone { format!("order{}_{}", self.order, 2 * self.order) } else { format!("order{}", self.order) }
    }
}
