//! `thermal_growth`: neighbouring links grow with temperature, or with time since the start where none was recorded.

use super::motion::{SHORT, extent};
use super::{
    Basis, Cause, Hypothesis, Measure, Motion, NumberSpec, Summary, Survey, Term, Variable, about, figure, names, warmth,
};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct ThermalGrowth;

/// 1/K: more than any polymer or metal that links are made of, four times aluminium.
const PER_KELVIN: f64 = 1e-4;
/// K; no arm warms up by more.
const WARM_UP: f64 = 60.0;
/// The same over a warm-up.
const MOST: f64 = WARM_UP * PER_KELVIN;
/// 1/K: aluminium has 23e-6, zinc 30e-6, the polymers of light links up to 70e-6. What the search may try is more, so that what is no growth is not forced into another name.
const MATERIAL: f64 = 7e-5;

/// What separates warmth of the arm from that of its surroundings.
pub(super) const MEASURE: Measure =
    Measure { rank: 4, advice: "log the arm's temperature from a cold start and watch a fixed target on the floor" };

impl Cause for ThermalGrowth {
    about! {
        name: names::THERMAL_GROWTH,
        place: "link, or neighbouring links",
        formula: "lengths grow by c (T - T0), or c (1 - exp(-time / tau))",
        size: "10 to 25 um/m for each kelvin",
        confounded: "tracker_drift, growth of neighbouring links",
        needs: "temperature or time",
        measure: Some(MEASURE),
    }

    /// Every run of neighbouring links.
    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let links = survey.joints() - 1;
        let long = |link: &usize| extent(survey.robot, *link).norm() > SHORT;
        let mut out = Vec::new();
        for (law, tried) in warmth::all(survey) {
            for (first, last) in (0..links).flat_map(|first| (first..links).map(move |last| (first, last))) {
                // A run begins and ends with a link that can grow, else it is the same as a shorter one.
                if long(&first) && long(&last) {
                    let largest = if matches!(law.first.basis, Basis::Settling { .. }) { MOST } else { PER_KELVIN };
                    let term = Term::new(&Self, Motion::Links { first, last }, law);
                    out.push(Hypothesis::new(term, tried).positive().within(largest));
                }
            }
        }
        out
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        match term.basis() {
            Basis::Settling { .. } => vec![("in_the_end".into(), Unit::One, 1e-2)],
            _ => vec![("per_kelvin".into(), Unit::One, 1e-3)],
        }
    }

    fn impossible(&self, term: &Term, p: &[f64], error: &dyn Fn(usize) -> f64, survey: &Survey) -> Option<String> {
        let value = *p.first()?;
        let warm_up = matches!(term.basis(), Basis::Settling { .. });
        let most = if warm_up { WARM_UP * MATERIAL } else { MATERIAL };
        let per = if warm_up { "in all" } else { "for each kelvin" };
        let [size, largest] = [value, most].map(|share| figure(1e6 * share, 0));
        if value < -error(0) {
            return Some("links do not shrink as they warm up".into());
        }
        let larger = (value > most).then(|| format!("{size} um/m {per} is more than the {largest} of any material of links"));
        larger.or_else(|| warmth::impossible(term, survey))
    }

    fn sentence(&self, summary: &Summary) -> String {
        let place = summary.place;
        match (summary.terms(self.name()).next().map(Term::basis), summary.parameters.first()) {
            (Some(Basis::Settling { constant, .. }), Some(n)) => format!(
                "{place} grows as the robot warms up, {} um/m in the end with a time constant of {}",
                figure(n.value * 1e6, 0),
                summary.clock.span(constant)
            ),
            (Some(_), Some(n)) => {
                let lag = summary.terms(self.name()).find_map(|term| match term.law().first.of {
                    Variable::Lagging { lag } => Some(format!(", lagging by {}", summary.clock.span(lag))),
                    _ => None,
                });
                format!("{place} grows by {} um/m for each kelvin{}", figure(n.value * 1e6, 1), lag.unwrap_or_default())
            }
            _ => format!("{place} grows with warmth"),
        }
    }
}
