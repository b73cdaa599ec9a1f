//! How far something has warmed up: by the measured temperature, at once or behind it, or by time since the start.

use super::basis::around;
use super::{Basis, Clock, Law, Survey, Term, Variable};

/// Time constants as shares of the recording.
const WARM_UPS: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.5];
const LAGS: [f64; 3] = [0.03, 0.1, 0.3];

/// Shortest and longest time constant, in the same shares: the one is a step at the start, the other a straight line.
const CONSTANTS: [f64; 2] = [0.02, 10.0];
/// The same of what lags: far behind, it no longer follows.
const BEHIND: [f64; 2] = [0.005, 2.0];

/// What the recording offers, and of how many of its kind each is one: its temperature above the first one (K), what follows it with a
/// lag, and warm-ups of several time constants, since what was measured need not be the temperature of what grows.
pub(super) fn all(survey: &Survey) -> Vec<(Law, usize)> {
    let [start, end] = survey.time;
    let above = |of| survey.reference_c.map(|zero| Law::new(of, Basis::Linear { zero, per: 1.0 }));
    let measured = above(Variable::Temperature);
    let (kinds, clocked) = (1 + 2 * usize::from(measured.is_some()), end > start);
    let lagging = LAGS.iter().filter(|_| clocked).filter_map(|share| above(Variable::Lagging { lag: share * (end - start) }));
    let times = WARM_UPS.iter().filter(|_| clocked);
    let times = times.map(|share| Law::new(Variable::Time, Basis::Settling { start, constant: share * (end - start) }));
    let several = |laws: Vec<Law>, of: usize| laws.into_iter().map(move |law| (law, of));
    let lagging = several(lagging.collect(), kinds * LAGS.len());
    let times = several(times.collect(), kinds * WARM_UPS.len());
    measured.map(|measured| (measured, kinds)).into_iter().chain(lagging).chain(times).collect()
}

/// Why a term cannot follow a warmth: its time constant is beyond what the recording can show, which only a straight line is left of.
pub(super) fn impossible(term: &Term, survey: &Survey) -> Option<String> {
    let time = match (term.law().first.of, term.basis()) {
        (Variable::Lagging { lag: time } | Variable::Work { cooling: time, .. }, _) => time,
        (_, Basis::Settling { constant, .. }) => constant,
        _ => return None,
    };
    let (clock, length) = (Clock::of(survey.data), survey.length());
    // What ends at the bound would go on beyond it.
    let beyond = time >= SLOWEST * CONSTANTS[1] * length;
    beyond.then(|| {
        format!("its time constant of {} is ten times as long as the recording ({})", clock.span(time), clock.span(length))
    })
}

/// A time constant of this share of its bound is at the bound.
const SLOWEST: f64 = 0.99;

/// Other time constants around that of a term's first factor.
pub(super) fn near(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    let long = survey.time[1] - survey.time[0];
    match (term.law().first.of, term.basis()) {
        (Variable::Lagging { lag }, _) => {
            let lags = around(lag, 1.7, 0.5, level, BEHIND.map(|share| share * long));
            lags.map(|lag| term.with(term.law().by(Variable::Lagging { lag }))).collect()
        }
        (Variable::Work { joint, cooling }, _) => {
            let coolings = around(cooling, 1.5, 0.5, level, CONSTANTS.map(|share| share * long));
            coolings.map(|cooling| term.with(term.law().by(Variable::Work { joint, cooling }))).collect()
        }
        (_, Basis::Settling { start, constant }) => {
            let constants = around(constant, 1.5, 0.5, level, CONSTANTS.map(|share| share * long));
            term.with_bases(constants.map(|constant| Basis::Settling { start, constant }))
        }
        _ => Vec::new(),
    }
}
