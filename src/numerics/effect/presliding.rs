//! `presliding`: lost motion that fades in over a travel after each reversal, as friction does before surfaces slide (Dahl).

use super::basis::around;
use super::{Cause, Hypothesis, Law, Measure, Motion, NumberSpec, Summary, Survey, Term, Variable, about, figure, names};
use crate::robot::RobotModel;
use crate::units::Unit;

pub struct Presliding;

/// Travels (rad) tried at first; shortest and longest.
const TRAVELS: [f64; 6] = [0.004, 0.012, 0.035, 0.1, 0.25, 0.6];
const BOUNDS: [f64; 2] = [0.001, 1.5];
/// Moves shorter than so many travels have not slid yet; so many rows must have ended one.
const SHORT: f64 = 2.0;
const ROWS: usize = 5;

impl Presliding {
    fn term(joint: usize, travel: f64) -> Term {
        Term::new(&Self, Motion::Joint { joint }, Law::of(Variable::Slip { joint, travel }))
    }
}

impl Cause for Presliding {
    about! {
        name: names::PRESLIDING,
        place: "joint",
        formula: "d = c z, z -> s + (z - s) exp(-|dq| / travel) from row to row",
        size: "5 to 60 arcsec over 0.5 to 10 deg",
        confounded: "backlash where all moves are long, joint_log_lag",
        needs: "rows in the order of measurement, short moves among them",
        measure: Some(Measure {
            rank: 5,
            advice: "approach one pose from both sides in steps of a tenth of a degree up to ten",
        }),
    }

    fn propose(&self, survey: &Survey) -> Vec<Hypothesis> {
        let joints = survey.revolute().filter(|joint| survey.both_directions(*joint));
        let shortly = |joint: usize, travel: f64| {
            let moves = survey.rows.iter().map(|row| survey.data.last_move(*row, joint).abs());
            moves.filter(|moved| *moved > 0.0 && *moved < SHORT * travel).take(ROWS).count() == ROWS
        };
        let pairs = joints.flat_map(|joint| TRAVELS.map(|travel| (joint, travel)));
        let pairs = pairs.filter(|(joint, travel)| shortly(*joint, *travel));
        pairs.map(|(joint, travel)| Hypothesis::new(Self::term(joint, travel), TRAVELS.len())).collect()
    }

    fn numbers(&self, _term: &Term, _robot: &RobotModel) -> Vec<NumberSpec> {
        vec![("half_gap".into(), Unit::Radian, 0.01)]
    }

    fn near(&self, term: &Term, _survey: &Survey, level: i32) -> Vec<Term> {
        let Variable::Slip { joint, travel } = term.law().first.of else { return Vec::new() };
        around(travel, 1.6, 0.5, level, BOUNDS).map(|travel| Self::term(joint, travel)).collect()
    }

    fn sentence(&self, summary: &Summary) -> String {
        let travel = summary.terms(self.name()).find_map(|term| match term.law().first.of {
            Variable::Slip { travel, .. } => Some(figure(travel.to_degrees(), 1)),
            _ => None,
        });
        let over = travel.map_or_else(String::new, |travel| format!(" over a travel of {travel} deg"));
        format!("lost motion of {} fades in after each reversal{over}: {} to either side", summary.place, summary.size())
    }
}
