//! How far something has warmed up: by the measured temperature, or by time since the start.

use super::basis::around;
use super::{Basis, Law, Survey, Variable};

/// Time constants as shares of the recording.
const WARM_UPS: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.5];

/// Shortest and longest time constant, in the same shares: the one is a step at the start, the other a straight line.
const CONSTANTS: [f64; 2] = [0.02, 10.0];

/// What the recording offers, and of how many of its kind each is one: its temperature above the first one (K), and warm-ups of
/// several time constants, since what was measured need not be the temperature of what grows.
pub(super) fn all(survey: &Survey) -> Vec<(Law, usize)> {
    let [start, end] = survey.time;
    let above = |reference| Law::new(Variable::Temperature, Basis::Linear { zero: reference, per: 1.0 });
    let measured = survey.reference_c.map(above);
    let kinds = 1 + usize::from(measured.is_some());
    let times = WARM_UPS.iter().filter(|_| end > start);
    let times = times.map(|share| Law::new(Variable::Time, Basis::Settling { start, constant: share * (end - start) }));
    let times = times.map(|time| (time, kinds * WARM_UPS.len()));
    measured.map(|measured| (measured, kinds)).into_iter().chain(times).collect()
}

/// Other time constants around that of a warm-up by time.
pub(super) fn near(basis: Basis, survey: &Survey, level: i32) -> Vec<Basis> {
    let Basis::Settling { start, constant } = basis else { return Vec::new() };
    let bounds = CONSTANTS.map(|share| share * (survey.time[1] - survey.time[0]));
    around(constant, 1.5, 0.5, level, bounds).map(|constant| Basis::Settling { start, constant }).collect()
}
