//! `zero_shift`: the zero of a joint steps at some time: a collision, a slipped belt or coupling, a new mastering.

use super::{
    Cause, FittedForms, Hypothesis, ModelledFinding, Motion, NumberSpec, Place, Summary, Survey, Term, about, change, holder,
    names,
};
use crate::robot::RobotModel;

/// A joint zero that steps at some time.
pub struct ZeroShift;

impl Cause for ZeroShift {
    about! {
        name: names::ZERO_SHIFT,
        place: "joint",
        formula: "d = c after some time",
        size: "10 to 500 arcsec",
        confounded: "base_shift (joint 1), tool_shift (last joint)",
        needs: "rows in the order of measurement",
        measure: Some(change::MEASURE),
        separable_by_poses: false,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let joints = 0..survey.joints();
        joints.flat_map(|joint| change::propose(&Self, &[Motion::Joint { joint }], survey)).collect()
    }

    fn numbers(&self, term: &Term, robot: &RobotModel) -> Vec<NumberSpec> {
        vec![("step".into(), term.motion().unit(robot), 0.1)]
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("the zero of {} steps by {}{}", summary.place, summary.size(), summary.when(self.name()))
    }

    fn identities(&self, term: &Term, _called: &str) -> Vec<(&'static str, Place)> {
        if term.motion().place() == Place::Joint(0) { vec![(names::BASE_SHIFT, Place::Base)] } else { Vec::new() }
    }

    fn in_the_model(&self, fitted: &FittedForms) -> Option<ModelledFinding> {
        holder::turned(fitted)
    }
}
