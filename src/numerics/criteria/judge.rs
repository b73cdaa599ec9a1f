//! How explanations are judged by folds.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "judge";
    /// Parts of the rows that were fitted, the same for every model that is compared.
    FOLDS: usize = 5, "folds", "literature: five to ten, Hastie, Tibshirani and Friedman (2009)", "changes nothing on 2";
}
