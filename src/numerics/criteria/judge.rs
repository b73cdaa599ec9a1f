//! How explanations are judged by folds.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "judge";
    /// Parts of the rows that were fitted, the same for every model that is compared.
    FOLDS: usize = 5, "folds", "literature: five to ten, Hastie, Tibshirani and Friedman (2009)", "changes nothing on 2";
    /// By how many standard errors of the difference stretches of a path must be predicted better with a finding.
    CLEARLY: f64 = 2.0, "standard errors", "judgement: a search among thousands of cells finds one by chance in whatever lasts", "";
    /// How often in a row stretches of a path confirm nothing of what a search found until the rest is noise.
    REFUTED: usize = 2, "searches", "judgement: a further search finds other cells that fit such noise by chance", "";
}
