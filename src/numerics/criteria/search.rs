//! When what is left is more than noise, how shapes of formulas are refined, and how few rows are searched at all.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "search";
    /// Below this probability that what is left is noise it has structure.
    SIGNIFICANT: f64 = 0.004, "probability", "count: one recording in 250 without a cause is searched in vain", "of 2: halved exact -1, placed -1, explained -1, held out x2.535, 2 moved; doubled nothing";
    /// Levels of refinement of a shape, and how many may bring nothing.
    LEVELS: i32 = 10, "levels", "count: steps fall to a thirtieth", "";
    /// Levels of refinement in a row that may bring nothing.
    IDLE: usize = 3, "levels", "judgement: bounds time", "";
    /// Fewest rows to fit: geometry alone takes some thirty parameters from three of each row.
    FEWEST: usize = 15, "rows", "count: some thirty parameters, three values a row", "";
}
