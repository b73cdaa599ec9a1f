//! Torques of moving arms: what a recording is refused for, and what of its laws is named.

use super::CriterionValue;
use super::table::criteria;

criteria! {
    "torque";
    /// Times the gravity torques of the declared masses beyond which, or below whose inverse, a unit of torque is wrong.
    UNIT: f64 = 3.0, "ratio", "physics: amperes and newton metres differ by about ten, torque constants and payloads by less than two", "";
    /// Share of a joint's torque (squared, about zero) that gravity must explain before the two are compared.
    WEIGHS: f64 = 0.3, "share", "judgement: friction of wrists is more than their load", "";
    /// Gravity of a joint over that of the heaviest one from which it has a say on units.
    WEIGHTY: f64 = 0.1, "share", "judgement: a tenth", "";
    /// How far a step of the clock is off the usual one, or off some of them in a row, to be uneven.
    UNEVEN: f64 = 0.2, "share of a step", "judgement: what filters do not see", "";
    /// Share of uneven steps from which on rows are interpolated by their stamps.
    UNEVEN_ROWS: f64 = 0.05, "share", "judgement: single rows that are stamped late are none", "";
    /// Steps in a row without a row that end a stretch of an uneven clock.
    PAUSE: f64 = 6.0, "periods", "judgement: what a smooth course bridges", "";
    /// Standard deviations below which a number is not named.
    NAMED: f64 = 2.0, "standard deviations", "literature: 95 % of a normal law", "";
    /// How near (logarithm) a shape number is to an end of its search to be none.
    AT_END: f64 = 0.02, "logarithm", "count: the finest grid has steps of 0.003, the one before of 0.01", "";
    /// Greatest torque of one law of friction, one standard deviation beforehand, over half the range of its joint's torque.
    FRICTION: f64 = 1.0, "share", "physics: no law of friction alone is more than the whole torque", "";
    /// What hypotheses about masses and about drives must differ by to exclude each other: twice the logarithm of their odds.
    APART: f64 = 8.0, "-2 ln likelihood", "judgement: odds of 50 to 1", "";
}
