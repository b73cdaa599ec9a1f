//! What is said: verdicts, names, probabilities, what is worth a word.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "words";
    /// Without repeats a residual is not called noise where it is this many times the instrument's.
    NOT_NOISE: f64 = 4.0, "ratio", "judgement: no tracker is four times worse than stated", "";
    /// What has no name explains nothing where it is more than this share of what was found.
    NAMELESS: f64 = 0.1, "share of the gain", "judgement: a tenth", "changes nothing on 2";
    /// The radius, and the place along the axis, may change by this share of the displacement.
    CONSTANT: f64 = 0.1, "share", "judgement: a tenth", "";
    /// Held-out rows lower probabilities where their mean squared residual is this many times that of the fitted rows.
    FAR_OFF: f64 = 2.0, "ratio of squares", "judgement: an inexact curve explains less", "";
    /// The model error of an unnamed finding is this share of its evidence.
    MODEL_ERROR: f64 = 0.01, "share of the evidence", "judgement: its curve is right to a tenth of its size", "";
    /// Causes of a round that are named.
    NAMED: usize = 4, "causes", "judgement: length of a line", "";
    /// Faults of single rows are seen as such or not at all.
    FAULT: f64 = 0.98, "probability", "count: wrong points among those said, concealed recordings", "";
    /// Standard errors by which a number must be beyond what is possible.
    FIRM: f64 = 2.0, "standard errors", "literature: 95 % of a normal law", "";
    /// Groups of rows of like loads, in which a curve of the load is looked at.
    LOADS: usize = 12, "groups", "judgement: some rows each, and a curve that turns back shows", "";
    /// Joints move the point by less than this (m/rad): no effect of theirs can be seen.
    STILL: f64 = 1e-3, "m/rad", "physics: a thousandth of a radian moves it by a micrometre", "";
    /// Standard deviations from which on a cause is found.
    FOUND: f64 = 5.0, "standard deviations", "judgement: as the search finds it", "";
    /// Clocks that are apart by less are no cause to measure again.
    CLOCKS: f64 = 1e-3, "s", "physics: clocks of controllers tick in milliseconds", "";
}
