//! How causes are searched: the criterion, the gate, what is refined.

use super::CriterionValue;
use super::table::criteria;

criteria! {
    "search";
    /// The first cause must lower the criterion by this much: strong evidence (Kass and Raftery, 1995), and the gate judges it
    /// too.
    DECISIVE: f64 = 8.0, "-2 ln of odds", "literature: strong evidence, Kass and Raftery (1995)", "changes nothing on 2";
    /// A further one by more: the shape of the first is never quite the true one, and what is left of it imitates others.
    FURTHER: f64 = 16.0, "-2 ln of odds", "literature: twice strong evidence, Kass and Raftery (1995)", "changes nothing on 2";
    /// The gate is closed above this probability that what is left is noise.
    SIGNIFICANT: f64 = 0.004, "probability", "count: one recording in 250 without a cause is searched in vain", "of 2: halved exact -1, placed -1, explained -1, held out x2.535, 2 moved; doubled nothing";
    /// Sets with more parameters than this are wide.
    WIDE: usize = 60, "parameters", "judgement: bounds time", "";
    /// Candidates in place of a single member.
    SINGLE: usize = 8, "candidates", "judgement: bounds time", "";
    /// Families of shapes that are refined before candidates are compared.
    FAMILIES: usize = 5, "families", "judgement: bounds time", "";
    /// Explanations whose criterion is this close fit equally well (Kass and Raftery, 1995).
    EQUIVALENT: f64 = 6.0, "-2 ln of odds", "literature: positive evidence, Kass and Raftery (1995)", "changes nothing on 2";
    /// -2 ln of the odds of a sign or size that physics forbids.
    IMPLAUSIBLE: f64 = 40.0, "-2 ln of odds", "judgement: beyond any recording's evidence but the strongest", "changes nothing on 2";
    /// Levels of refinement of a shape, and how many may bring nothing.
    LEVELS: i32 = 10, "levels", "count: steps fall to a thirtieth", "";
    /// Levels of refinement in a row that may bring nothing.
    IDLE: usize = 3, "levels", "judgement: bounds time", "";
    /// A group may have at most one parameter for so many residual rows.
    ROWS_EACH: usize = 4, "residual rows", "judgement: fewer leave nothing to judge by", "changes nothing on 2";
    /// A compliance that changed by more than this share changes what loads do.
    SAME: f64 = 0.01, "share", "judgement: below what any other cause notices", "changes nothing on 1";
    /// Levels of refinement of a rival's shape.
    RIVAL_LEVELS: i32 = 8, "levels", "count: steps fall to a sixteenth", "";
    /// Fewest rows to fit: geometry alone takes some thirty parameters from three of each row.
    FEWEST: usize = 15, "rows", "count: some thirty parameters, three values a row", "";
}
