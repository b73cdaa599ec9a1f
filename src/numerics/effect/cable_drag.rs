//! `cable_drag`: a hose package pulls on a joint by its angle, seen through the joint's compliance as a balancer's spring is; or by its
//! own angle and its neighbour's, as a law without a name that is called so.

use super::spring::{MEASURE, Spring};
use super::unknown::described;
use super::{Cause, Hypothesis, Summary, Survey, about, names};

/// Hoses that pull joints along.
pub struct CableDrag;

impl Cause for CableDrag {
    about! {
        name: names::CABLE_DRAG,
        place: "joint",
        formula: "t by the angles of the joint and its neighbour",
        size: "1 to 10 % of the joint's torque",
        confounded: "unknown, gear_cyclic of order 1",
        needs: "motor currents",
        measure: Some(MEASURE),
        read: Some(|body| Spring::read(&CableDrag, body)),
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        Spring::propose(&Self, survey, |joint| !Spring::balances(joint))
    }

    fn sentence(&self, summary: &Summary) -> String {
        let place = summary.place;
        match described(summary) {
            Some(law) => format!("something pulls on {place} as a hose package does: {law}"),
            None => format!(
                "a torque on {place} that depends on its angle, e.g. from a hose package, is missing from the torque model"
            ),
        }
    }
}
