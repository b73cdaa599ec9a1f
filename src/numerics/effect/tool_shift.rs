//! `tool_shift`: the mounting of the measured target steps at some time.

use super::{Axes, Cause, CauseDescription, Hypothesis, Measure, Motion, NumberSpec, Summary, Survey, Term, change};
use crate::robot::RobotModel;

/// A target that moves at some time.
pub struct ToolShift;

impl ToolShift {
    /// Canonical name, as in tables and YAML.
    pub const NAME: &'static str = "tool_shift";
}

impl Cause for ToolShift {
    fn about(&self) -> &'static CauseDescription {
        &CauseDescription {
            name: Self::NAME,
            place: "tool",
            formula: "the target moves at some time",
            size: "20 to 500 um",
            confounded: "zero_shift of the last joints",
            needs: "rows in the order of measurement",
        }
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        change::propose(&Self, &[Motion::Tool { axes: Axes::Place }], survey)
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        term.motion().frame_numbers(|name| name.to_string())
    }

    fn near(&self, term: &Term, survey: &Survey, _level: i32) -> Vec<Term> {
        change::near(term, survey)
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("the target on the tool has moved{}", summary.when(self.name()))
    }

    fn measure(&self) -> Option<Measure> {
        Some(change::MEASURE)
    }

    fn is_separable_by_poses(&self) -> bool {
        false
    }
}
