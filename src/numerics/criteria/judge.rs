//! How explanations are judged by folds.

use super::CriterionValue;
use super::table::criteria;

criteria! {
    "judge";
    /// Rivals that are tried in place of a cause.
    RIVALS: usize = 4, "causes", "judgement: bounds time", "";
    /// Parts of the rows that were fitted, the same for every model that is compared.
    FOLDS: usize = 5, "folds", "literature: five to ten, Hastie, Tibshirani and Friedman (2009)", "changes nothing on 2";
    /// A model that is worse by this share of the folds' rms, and clearly so, is worse.
    WORSE: f64 = 0.03, "share of the rms", "judgement: what a user would not notice", "changes nothing on 2";
    /// Standard errors by which folds must differ to differ clearly.
    CLEARLY: f64 = 2.0, "standard errors", "literature: 95 % of a normal law", "";
}
