//! Rows that no smooth model can follow.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "screen";
    /// Beyond this many standard deviations a row is out whatever the tails: Student's t with 3 degrees of freedom gets there
    /// four times in 10,000 rows.
    GROSS: f64 = 20.0, "standard deviations", "literature: Student's t with 3 degrees of freedom gets there four times in 10,000 rows", "";
    /// The bulk ends at this quantile of the rows that are not gross ...
    BULK: f64 = 0.98, "quantile", "judgement: one row in fifty may be wrong", "";
    /// ... and far outside begins this many times farther out: with normal noise at 9.4 standard deviations.
    FAR: f64 = 3.0, "ratio", "count: with normal noise 9.4 standard deviations", "changes nothing on 2";
    /// Rows that are wrong in any recording; beyond these, the share above the bulk.
    MISTAKES: usize = 3, "rows", "judgement: single slips happen in any recording", "";
    /// By how much the other rows may be off more where causes are found that explain the rows that stand out.
    NO_WORSE: f64 = 2.0, "ratio", "judgement: rows at the edge of what moves few of them are off, too", "";
    /// With more than this share of unexplained rows, beyond what chance adds, the model is wrong and not the rows.
    CROWD: f64 = 0.125, "share", "judgement: an eighth", "changes nothing on 2";
    /// Among a crowd, only rows this many times the limit away are mistakes all the same.
    BEYOND_CROWD: f64 = 10.0, "ratio", "judgement: an order of magnitude", "";
    /// A nominal robot puts its points right to this share of their distance from the tracker; units differ by far more.
    NOMINAL_TOLERANCE: f64 = 0.05, "share of the distance", "physics: units differ by far more", "";
    /// Rounds in which a row may come back, since the first fit suffers from what it shall find. Later rows only go: that ends.
    READMITTING: usize = 3, "rounds", "judgement: it settles in two", "";
    /// Rows of a stretch, enough for six numbers and a judgement.
    STRETCH: usize = 20, "rows", "count: six numbers and a judgement", "";
    /// Stretches begin so many rows apart: they overlap, so that few rows beside the place where the logs slip go unseen.
    STEP: usize = 4, "rows", "count: a fifth of a stretch", "";
    /// A nominal robot leaves less than this share of the size of a stretch.
    NOMINAL: f64 = 0.03, "share", "physics: nominal robots err by millimetres in metres", "";
    /// With the right joints so many times less is left.
    SLIPPED_BETTER: f64 = 5.0, "ratio", "judgement: beyond chance in twenty rows", "";
    /// Under the base of the whole recording, where a nominal robot leaves more, so many times less is left of such rows. A
    /// base of their own takes up a step of the pitch of a grid.
    TOGETHER: f64 = 2.0, "ratio", "judgement: beyond chance in some hundred rows", "";
    /// Two measurements of one target in one pose that are this many times their noise apart: one of them is wrong.
    DISAGREES: f64 = 10.0, "standard deviations", "judgement: beyond any tail of noise", "";
    /// Repeats of a pose scatter by less than this, whatever the joints do, m.
    JOINTS: f64 = 0.5e-3, "m", "physics: repeatability of industrial arms is below 0.1 mm", "";
    /// No joint, gear or tool that still moves puts a point so far off, m.
    IMPOSSIBLE: f64 = 20e-3, "m", "physics: arms that still move err by less", "";
    /// A direction in which a row alone decides more than this cannot be tested: nothing contradicts the row.
    SOLE: f64 = 0.98, "leverage", "count: one row in fifty's residual is left", "";
    /// A slipped point agrees to this share of its distance: far closer than chance, far wider than rounding in the wrong unit.
    SLIP_TOLERANCE: f64 = 1e-3, "share of the distance", "judgement: far closer than chance", "";
    /// Closer to the origin than this share of the predicted distance is zero.
    ZERO: f64 = 1e-4, "share of the distance", "judgement: far closer than any point", "";
    /// A point belongs to other joints only if those fit it this many times better than its own.
    BETTER: f64 = 4.0, "ratio", "judgement: beyond chance among all rows", "";
    /// Of all rows whose joints fit a point, so many nearest in the recording are looked at: enough for any number of repeats.
    CANDIDATES: usize = 64, "rows", "judgement: bounds time", "";
    /// Stops in a row that make a shifted block or an event; a stop is a row, or all targets that were measured in one pose.
    RUN: usize = 3, "stops", "count: three in a row by chance, at a wrong row in ten: one in a thousand", "";
    /// A run of this length is no coincidence of outliers even where every tenth row is one.
    LONG_RUN: usize = 6, "stops", "count: at a wrong row in ten one in a million", "";
    /// A shorter run is an event only if its rows stand out alike: largest over smallest residual.
    ALIKE: f64 = 5.0, "ratio", "judgement: outliers scatter by orders of magnitude", "";
    /// By chance so many recordings in one have a row beyond the reach.
    CHANCE: f64 = 0.005, "probability", "count: one recording in 200", "";
}
