//! Formulas that are proposed for what has no name.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "closed_form";
    /// Most formulas that are shown.
    SHOWN: usize = 3, "formulas", "judgement: length of a page", "";
    /// A dearer formula must be better by this share; one within it of the best is as good.
    BETTER: f64 = 0.005, "share", "judgement: half a percent", "";
    /// A formula whose error is this many times that of the curve says something else than the curve.
    LIKE: f64 = 1.1, "ratio", "judgement: a tenth", "";
    /// rad, between places at which a search begins.
    SPACING: f64 = 0.2, "rad", "judgement: bounds time", "";
    /// Highest wave number of an angle.
    ORDER: f64 = 50.0, "orders", "count: gears have up to 48", "";
    /// Highest wave number of another variable.
    TURNS: f64 = 8.0, "turns of the range", "judgement: what rows resolve", "";
    /// Starts of a formula's shape numbers that are refined.
    STARTS: usize = 4, "starts", "judgement: bounds time", "";
}
