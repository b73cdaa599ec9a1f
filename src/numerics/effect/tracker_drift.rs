//! `tracker_drift`: the tracker's frame moves slowly: steadily, with the warm-up, or as a slow curve in time.

use super::basis::around;
use super::{
    Axes, Basis, Cause, Clock, Hypothesis, Law, Motion, NumberSpec, Summary, Survey, Term, Variable, about, names, warmth,
};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;

pub struct TrackerDrift;

/// Powers of time by which a drift may go on: what settles and what begins slowly.
const POWERS: [f64; 2] = [0.25, 3.0];
/// Cosines of a slow course.
const SLOW: usize = 3;

impl Cause for TrackerDrift {
    about! {
        name: names::TRACKER_DRIFT,
        place: "tracker",
        formula: "the tracker's frame moves steadily, with the warm-up, or slowly",
        size: "10 to 200 um",
        confounded: "thermal_growth, base_shift",
        needs: "time",
        measure: Some(super::thermal_growth::MEASURE),
        of_the_measurement: true,
        separable_by_poses: false,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let [start, end] = survey.time;
        if end <= start {
            return Vec::new();
        }
        let form = |axes, law| Term::new(&Self, Motion::Tracker { axes }, law);
        let mut out = Vec::new();
        for axes in [Axes::Place, Axes::Both] {
            let steady = Law::new(Variable::Time, Basis::Power { start, end, exponent: 1.0 });
            out.push(Hypothesis::new(form(axes, steady), 3));
            for (law, tried) in warmth::all(survey) {
                out.push(Hypothesis::new(form(axes, law), 3 * tried).penalised(*RARE));
            }
        }
        let slow = Law::new(Variable::Time, Basis::Cosines { low: start, high: end, count: SLOW });
        out.push(Hypothesis::new(form(Axes::Place, slow), 1).penalised(*RARE));
        out
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        let frame = |suffix: String| term.motion().frame_numbers(move |name| format!("{name}{suffix}"));
        match term.basis() {
            Basis::Cosines { count, .. } => (1..=count).flat_map(|k| frame(format!("_cos{k}"))).collect(),
            _ => frame(String::new()),
        }
    }

    fn near(&self, term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
        match term.basis() {
            Basis::Power { start, end, exponent } => {
                let exponents = around(exponent, 1.5, 0.7, level, POWERS);
                term.with_bases(exponents.map(|exponent| Basis::Power { start, end, exponent }))
            }
            _ => warmth::near(term, survey, level),
        }
    }

    fn impossible(&self, term: &Term, _p: &[f64], _error: &dyn Fn(usize) -> f64, survey: &Survey) -> Option<String> {
        warmth::impossible(term, survey)
    }

    fn sentence(&self, summary: &Summary) -> String {
        let how = match summary.terms(self.name()).next().map(Term::basis) {
            Some(Basis::Power { exponent, .. }) if exponent < 0.7 => "slower and slower",
            Some(Basis::Power { exponent, .. }) if exponent > 1.4 => "faster and faster",
            Some(Basis::Power { .. }) => "steadily",
            Some(Basis::Cosines { .. }) | None => "slowly",
            Some(_) => "with the warm-up",
        };
        let over = if summary.clock == Clock::Rows { " over the recording's rows" } else { "" };
        format!("the tracker's frame drifts {how}{over}")
    }
}
