//! Poses that are proposed.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "choose";
    /// Random sets to compare with.
    RANDOM_SETS: usize = 200, "sets", "count: quantiles to half a percent", "";
    /// Poses at which the prediction's uncertainty is stated.
    WORKSPACE: usize = 500, "poses", "count: a mean to a few percent", "";
    /// Rounds of exchange with neighbours, each with smaller steps.
    STEPS: [f64; 3] = [0.5, 0.2, 0.06], "share of the range", "judgement: bounds time", "";
    /// Information in every direction before the first pose, in units of an average candidate's: makes the first steps defined.
    RIDGE: f64 = 1e-3, "candidates", "judgement: below any candidate's", "";
    /// Passes over all chosen poses; later ones gain next to nothing.
    PASSES: usize = 4, "passes", "judgement: bounds time", "";
    /// Gain of log determinant that is worth an exchange.
    WORTH: f64 = 1e-6, "ln of the determinant", "judgement: below any figure that is told", "";
    /// Random poses in a row that may be refused before one gives up.
    TRIES: usize = 50_000, "poses", "judgement: bounds time", "";
    /// Random postures that are tried for one that closes, at most.
    POSTURES: usize = 200, "postures", "judgement: bounds time", "";
    /// How far off the last axis a ball is tried.
    OFF: [f64; 4] = [0.01, 0.02, 0.05, 0.1], "m", "physics: balls and holders", "";
}
