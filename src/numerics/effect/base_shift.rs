//! `base_shift`: the mounting of the base steps at some time, displaced, or displaced and turned.

use super::{Axes, Cause, Hypothesis, Motion, Summary, Survey, about, change, names};

pub struct BaseShift;

impl Cause for BaseShift {
    about! {
        name: names::BASE_SHIFT,
        place: "base",
        formula: "the base moves at some time",
        size: "20 to 500 um",
        confounded: "zero_shift of joint 1, tracker_drift",
        needs: "rows in the order of measurement",
        measure: Some(change::MEASURE),
        of_the_measurement: true,
        separable_by_poses: false,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        change::propose(&Self, &[Axes::Place, Axes::Both].map(|axes| Motion::Base { axes }), survey)
    }

    fn sentence(&self, summary: &Summary) -> String {
        format!("the base (or the tracker) has moved{}", summary.when(self.name()))
    }
}
