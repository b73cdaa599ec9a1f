//! How rare causes are, and how many forms of a kind are tried, where that is no count of what is listed beside it.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "effect";
    /// One in three: what comes with something else that is common (a wheel far off its centre, a spring of some length at rest,
    /// a stand that swings, a product of two laws).
    UNCOMMON: f64 = 2.0, "-2 ln of odds", "judgement: a class of rarity", "changes nothing on 2";
    /// One in seven: what arms and instruments in order hardly show.
    RARE: f64 = 4.0, "-2 ln of odds", "judgement: a class of rarity", "changes nothing on 2";
    /// One in twenty: what needs a fault of build (a joint that drives one far from it, a link that grows askew, a loose load).
    RARER: f64 = 6.0, "-2 ln of odds", "judgement: a class of rarity", "";
    /// One in 150: a stubby wrist link that bends.
    UNLIKELY: f64 = 10.0, "-2 ln of odds", "judgement: a class of rarity", "";
    /// Low orders of a gear with either kind of wheel, and orders in another joint's angle.
    LOW_ORDERS: usize = 6, "forms", "count: three orders of two kinds", "changes nothing on 2";
    /// Orders, axes and ways in which an axis wobbles.
    WOBBLES: usize = 12, "forms", "count: two tilts of six orders", "";
    /// Bends of a wind-up, and thresholds of lost motion.
    BENDS: usize = 10, "forms", "count: ten laws are proposed", "";
    /// Standard deviation of what a spring does under loads beyond those of the fitted rows, where these are twice as large.
    STIFFNESS_BEYOND: f64 = 0.5, "share of the deflection", "physics: stiffnesses change by 5 to 50 % over a load", "";
}
