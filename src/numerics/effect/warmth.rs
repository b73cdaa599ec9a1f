//! How far something has warmed up: by the measured temperature, at once or behind it, by time since the start, or by a joint's own work.

use super::basis::around;
use super::{Basis, Clock, Law, Survey, Term, Variable};
use crate::robot::Memory;

/// The source from which a warmth is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Warmth {
    /// The recorded temperature above the first one (K), at once or with a lag: what was measured need not be what grows.
    Temperature,
    /// Time since the start, which stands for a temperature that nobody measured; 1 in the end.
    WarmUp,
    /// How fast the joint moved of late; 1 at its most.
    Work,
}

/// Time constants as shares of the recording: of warm-ups, lags, and the cooling of a joint.
const WARM_UPS: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.5];
const LAGS: [f64; 3] = [0.03, 0.1, 0.3];
const COOLINGS: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// Shortest and longest time constant, in the same shares: the one is a step at the start, the other a straight line.
const CONSTANTS: [f64; 2] = [0.02, 10.0];
/// The same of what lags: far behind, it no longer follows.
const BEHIND: [f64; 2] = [0.005, 2.0];

impl Warmth {
    /// What the recording offers, and of how many of its kind each is one.
    pub(super) fn laws(self, joint: Option<usize>, survey: &Survey) -> Vec<(Law, usize)> {
        let [start, end] = survey.time;
        let shared = |shares: &'static [f64]| {
            shares
                .iter()
                .filter(move |_| end > start)
                .map(move |share| share * (end - start))
        };
        let above = |variable| {
            survey
                .reference_c
                .map(|zero| Law::new(variable, Basis::Linear { zero, per: 1.0 }))
        };
        let kinds = 1 + 2 * usize::from(survey.reference_c.is_some());
        match (self, joint) {
            (Self::Temperature, _) => {
                let lagging = shared(&LAGS).filter_map(|lag| above(Variable::Lagging { lag }));
                let measured = above(Variable::Temperature).map(|law| (law, kinds));
                measured
                    .into_iter()
                    .chain(lagging.map(|law| (law, kinds * LAGS.len())))
                    .collect()
            }
            (Self::WarmUp, _) => {
                let law = |constant| Law::new(Variable::Time, Basis::Settling { start, constant });
                shared(&WARM_UPS)
                    .map(|constant| (law(constant), kinds * WARM_UPS.len()))
                    .collect()
            }
            (Self::Work, Some(joint)) if survey.data.has_clock() => {
                let law = |cooling| {
                    let heat =
                        |row: &usize| survey.data.memory(Memory::Work { joint, cooling }, *row);
                    let per = survey.rows.iter().map(heat).fold(0.0, f64::max);
                    (per > 0.0).then(|| {
                        Law::new(
                            Variable::Work { joint, cooling },
                            Basis::Linear { zero: 0.0, per },
                        )
                    })
                };
                let laws: Vec<Law> = shared(&COOLINGS).filter_map(law).collect();
                let tried = 3 * laws.len();
                laws.into_iter().map(|law| (law, tried)).collect()
            }
            (Self::Work, _) => Vec::new(),
        }
    }

    /// What the number of a law is called that follows it.
    pub(super) fn number(self) -> &'static str {
        match self {
            Self::Temperature => "per_kelvin",
            Self::WarmUp => "in_the_end",
            Self::Work => "at_most_work",
        }
    }

    pub(super) fn is(self, variable: Variable, basis: Basis) -> bool {
        match self {
            Self::Temperature => {
                matches!(variable, Variable::Temperature | Variable::Lagging { .. })
            }
            Self::WarmUp => matches!((variable, basis), (Variable::Time, Basis::Settling { .. })),
            Self::Work => matches!(variable, Variable::Work { .. }),
        }
    }
}

/// The time constant of a term that follows a warmth, if it has one, s.
pub(super) fn time_constant(term: &Term) -> Option<f64> {
    match (term.law().first.variable, term.basis()) {
        (Variable::Lagging { lag: time } | Variable::Work { cooling: time, .. }, _) => Some(time),
        (_, Basis::Settling { constant, .. }) => Some(constant),
        _ => None,
    }
}

/// Why a term cannot follow a warmth: its time constant is beyond what the recording can show, which only a straight line is left of.
pub(super) fn impossible(term: &Term, survey: &Survey) -> Option<String> {
    let time = time_constant(term)?;
    let (clock, length) = (Clock::of(survey.data), survey.length());
    // What ends at the bound would go on beyond it.
    let beyond = time >= SLOWEST * CONSTANTS[1] * length;
    beyond.then(|| {
        format!(
            "its time constant of {} is ten times as long as the recording ({})",
            clock.span(time),
            clock.span(length)
        )
    })
}

/// A time constant of this share of its bound is at the bound.
const SLOWEST: f64 = 0.99;

/// Other time constants around that of a term's first factor.
pub(super) fn near(term: &Term, survey: &Survey, level: i32) -> Vec<Term> {
    let bounds = |shares: [f64; 2]| shares.map(|share| share * survey.length());
    match (term.law().first.variable, term.basis()) {
        (Variable::Lagging { lag }, _) => {
            let lags = around(lag, 1.7, 0.5, level, bounds(BEHIND));
            lags.map(|lag| term.with(term.law().by(Variable::Lagging { lag })))
                .collect()
        }
        (Variable::Work { joint, cooling }, _) => {
            let coolings = around(cooling, 1.5, 0.5, level, bounds(CONSTANTS));
            coolings
                .map(|cooling| term.with(term.law().by(Variable::Work { joint, cooling })))
                .collect()
        }
        (_, Basis::Settling { start, constant }) => {
            let constants = around(constant, 1.5, 0.5, level, bounds(CONSTANTS));
            term.with_bases(constants.map(|constant| Basis::Settling { start, constant }))
        }
        _ => Vec::new(),
    }
}
