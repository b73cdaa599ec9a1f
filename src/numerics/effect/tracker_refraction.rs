//! `tracker_refraction`: ranges scale with the air's temperature, which the instrument does not follow.

use super::{
    Basis, Cause, Hypothesis, Measure, Motion, NumberSpec, Polar, Summary, Survey, Term, Variable, about, figure, warmth,
};
use crate::criteria::effect::RARE;
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct TrackerRefraction;

/// 1/K, and over a warm-up by 30 K: air changes by 1e-6 a kelvin; more is a weather station with a fault.
const MOST: [f64; 2] = [1e-5, 3e-4];
/// K; no air in a hall warms up by more.
const WARM_UP: f64 = 30.0;
/// 1/K: five times what air does, since the temperature that was logged need not be that along the beam.
const AIR: f64 = 5e-6;

impl Cause for TrackerRefraction {
    about! {
        name: "tracker_refraction",
        place: "tracker",
        formula: "ranges grow by c (T - T0), or c (1 - exp(-time / tau)), in proportion to their length",
        size: "1 um/m for each kelvin",
        confounded: "tracker_drift and thermal_growth of all links",
        needs: "temperature or time, the instrument at the recording's origin",
        measure: Some(Measure {
            rank: 2,
            advice: "log the air's temperature and measure a fixed point on the floor now and then",
        }),
        of_the_measurement: true,
        separable_by_poses: false,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let laws = warmth::all(survey).into_iter().filter(|_| survey.seen_from_outside());
        let terms = laws.map(|(law, tried)| {
            let most = MOST[usize::from(matches!(law.first.basis, Basis::Settling { .. }))];
            let law = law.times(Variable::Range, Basis::PROPORTIONAL);
            let term = Term::new(&Self, Motion::Instrument { of: Polar::Range }, law);
            Hypothesis::new(term, tried).within(most).penalised(*RARE)
        });
        terms.collect()
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        let settling = matches!(term.basis(), Basis::Settling { .. });
        vec![(if settling { "in_the_end" } else { "per_kelvin" }.into(), Unit::One, 1e-4)]
    }

    fn impossible(&self, term: &Term, p: &[f64], _error: &dyn Fn(usize) -> f64, survey: &Survey) -> Option<String> {
        let value = *p.first()?;
        let warm_up = matches!(term.basis(), Basis::Settling { .. });
        let most = if warm_up { WARM_UP * AIR } else { AIR };
        let per = if warm_up { "in all" } else { "for each kelvin" };
        let [size, largest] = [value.abs(), most].map(|share| figure(1e6 * share, 0));
        let larger = (value.abs() > most).then(|| format!("{size} um/m {per} is more than the {largest} that air can make"));
        larger.or_else(|| warmth::impossible(term, survey))
    }

    fn sentence(&self, summary: &Summary) -> String {
        let size = summary.parameters.first().map_or_else(String::new, |n| figure(n.value * 1e6, 1));
        match summary.terms(self.name()).next().map(Term::basis) {
            Some(Basis::Settling { constant, .. }) => {
                let constant = summary.clock.span(constant);
                format!(
                    "the tracker's ranges grow as the air warms up, by {size} um/m in the end with a time constant of {constant}"
                )
            }
            _ => format!("the tracker's ranges grow by {size} um/m for each kelvin"),
        }
    }
}
