//! `counterbalance`: a spring missing from the torque model; its torque is periodic in the joint's angle.
//!
//! Balancers sit on joints 2 and 3; a torque by the angle of any other joint is that of a hose or cable.

use super::spring::{MEASURE, Spring};
use super::{Cause, Hypothesis, Summary, Survey, about, names};

pub struct Counterbalance;

impl Cause for Counterbalance {
    about! {
        name: names::COUNTERBALANCE,
        place: "joint 2 or 3",
        formula: "t = a sin q + b cos q, and of 2 q, on top of gravity",
        size: "10 to 60 % of the gravity torque",
        confounded: "gear_cyclic of order 1, link_mass",
        needs: "link masses and motor currents",
        measure: Some(MEASURE),
        read: Some(|body| Spring::read(&Counterbalance, body)),
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        Spring::propose(&Self, survey, Spring::balances)
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("a balancer (spring or gas) acts on {} and is missing from the torque model", summary.place)
    }
}
