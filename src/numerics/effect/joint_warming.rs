//! `joint_warming`: a joint's zero, ratio or stiffness follows a temperature, the warm-up, or the heat of the joint's own work.

use super::{Basis, Cause, Hypothesis, Law, Motion, NumberSpec, Summary, Survey, Term, Variable, about, figure, names, warmth};
use crate::criteria::effect::RARE;
use crate::robot::{Memory, RobotModel};
use crate::units::Unit;

pub struct JointWarming;

/// Cooling times of a joint as shares of the recording.
const COOLINGS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// What of a joint follows.
const KINDS: usize = 3;

/// Heat of the joint's own work, 1 at its most.
fn work(joint: usize, survey: &Survey) -> Vec<(Law, usize)> {
    let [start, end] = survey.time;
    let law = |share: &f64| {
        let cooling = share * (end - start);
        let heat = |row: &usize| survey.data.memory(Memory::Work { joint, cooling }, *row);
        let per = survey.rows.iter().map(heat).fold(0.0, f64::max);
        (per > 0.0).then(|| Law::new(Variable::Work { joint, cooling }, Basis::Linear { zero: 0.0, per }))
    };
    let laws: Vec<Law> = COOLINGS.iter().filter(|_| end > start && survey.data.has_clock()).filter_map(law).collect();
    let tried = 3 * laws.len();
    laws.into_iter().map(|law| (law, tried)).collect()
}

impl Cause for JointWarming {
    about! {
        name: names::JOINT_WARMING,
        place: "joint",
        formula: "d = w, w q or w t, w: temperature above the first, warm-up, or recent work",
        size: "1 to 50 arcsec",
        confounded: "tracker_drift and base_shift (joint 1), thermal_growth",
        needs: "temperature or time",
        measure: Some(super::thermal_growth::MEASURE),
        separable_by_poses: false,
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let mut out = Vec::new();
        for joint in survey.revolute() {
            let mut add = |law, tried: usize| {
                let term = Term::new(&Self, Motion::Joint { joint }, law);
                out.push(Hypothesis::new(term, KINDS * tried).penalised(*RARE));
            };
            for (law, tried) in warmth::all(survey).into_iter().chain(work(joint, survey)) {
                add(law, tried);
                add(law.times(Variable::Angle { joint }, Basis::PROPORTIONAL), tried);
                if survey.is_loaded(joint) {
                    add(law.times(Variable::Load { joint }, Basis::PROPORTIONAL), tried);
                }
            }
        }
        out
    }

    fn numbers(&self, term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        let when = match (term.law().first.of, term.basis()) {
            (Variable::Work { .. }, _) => "at_most_work",
            (_, Basis::Settling { .. }) => "in_the_end",
            _ => "per_kelvin",
        };
        let (unit, sigma) = match term.law().times.map(|factor| factor.of) {
            None => (Unit::Radian, 0.01),
            Some(Variable::Angle { .. }) => (Unit::One, 0.01),
            Some(_) => (Unit::RadianPerNewtonMetre, 1e-4),
        };
        vec![(when.into(), unit, sigma)]
    }

    fn variant(&self, term: &Term) -> String {
        match term.law().times.map(|factor| factor.of) {
            None => "zero",
            Some(Variable::Angle { .. }) => "ratio",
            Some(_) => "stiffness",
        }
        .into()
    }

    fn impossible(&self, term: &Term, _p: &[f64], _error: &dyn Fn(usize) -> f64, survey: &Survey) -> Option<String> {
        warmth::impossible(term, survey)
    }

    fn sentence(&self, summary: &Summary) -> String {
        let each = summary.estimates(names::JOINT_WARMING).map(|(term, numbers)| {
            let size = |scale: f64, decimals| numbers.first().map_or_else(String::new, |n| figure(scale * n.value, decimals));
            let what = match term.law().times.map(|factor| factor.of) {
                None => format!("its zero by {} arcsec", size(1.0, 0)),
                Some(Variable::Angle { .. }) => format!("its ratio by {} ppm", size(1e6, 0)),
                Some(_) => format!("its compliance by {} urad/Nm", size(1e6, 2)),
            };
            match (term.law().first.of, term.basis()) {
                (Variable::Work { cooling, .. }, _) => {
                    format!("{what} at its hardest work, decaying with a time constant of {}", summary.clock.span(cooling))
                }
                (_, Basis::Settling { constant, .. }) => {
                    format!("{what} in the end with a time constant of {}", summary.clock.span(constant))
                }
                (Variable::Lagging { lag }, _) => format!("{what} per kelvin, lagging by {}", summary.clock.span(lag)),
                _ => format!("{what} for each kelvin"),
            }
        });
        format!("{} changes with warmth: {}", summary.place, each.collect::<Vec<_>>().join(", "))
    }
}
