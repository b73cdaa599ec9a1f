//! `tool_shift`: the mounting of the measured target steps at some time.

use super::{Axes, Cause, FittedForms, Hypothesis, ModelledFinding, Motion, Summary, Survey, about, change, holder, names};

/// A target that moves at some time.
pub struct ToolShift;

impl Cause for ToolShift {
    about! {
        name: names::TOOL_SHIFT,
        place: "tool",
        formula: "the target moves at some time",
        size: "20 to 500 um",
        confounded: "zero_shift of the last joints",
        needs: "rows in the order of measurement",
        measure: Some(change::MEASURE),
        separable_by_poses: false,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        change::propose(&Self, &[Motion::Tool { axes: Axes::Place }], survey)
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("the target on the tool has moved{}", summary.when(self.name()))
    }

    fn in_the_model(&self, fitted: &FittedForms) -> Option<ModelledFinding> {
        holder::turned(fitted)
    }
}
