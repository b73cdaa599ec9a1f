//! What the robots of a model have in common: when a cause of a group joins, and which robots are not like their siblings.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "fleet";
    /// Chance of a false statement on sizes or trends in a whole fleet, shared by all that are tested.
    CHANCE: f64 = 0.01, "probability", "judgement: one fleet in a hundred", "";
    /// Ratio of a robot's size to the usual one from which it is listed, however sure it is.
    APART: f64 = 1.5, "ratio", "judgement: less does not ask for a technician", "";
    /// Share of the robots that have a cause from which those that lack it are listed.
    USUALLY: f64 = 0.75, "share", "judgement: what a quarter lacks is a variant of the model", "";
    /// Probability from which a robot is listed as one that lacks what the others have; below a half its sentence says `perhaps`.
    LACKS: f64 = 0.3, "probability", "measured by tests/reference/fleet_causes.py: of 2,000 twins with evidences of e^4.8 it lists 89 % of those that lack a cause; three in four of those listed do", "";
    /// Robots whose sizes make a usual one.
    SIBLINGS: usize = 4, "robots", "count: a median and a scatter", "";
    /// Least scatter of sizes from robot to robot: that few robots scatter by less is chance.
    LEAST_SPREAD: f64 = 0.1, "share of the usual size", "physics: parts of one drawing differ by a tenth", "";
    /// Probability of a name from which it is stated by itself; below it the cause is the name or its rival.
    DECIDED: f64 = 0.9, "probability", "judgement: a technician opens the joint that is named", "";
    /// ln of the least evidence of a cell: its amplitude may be one that no row shows, one of the 28 that are weighed.
    LEAST_EVIDENCE: f64 = -3.3, "ln of evidence", "count: ln of 1 in 28", "";
    /// ln of the evidence below which no row is written of a cell with a name, and of anything else.
    WRITTEN: [f64; 2] = [-2.0, -1.0], "ln of evidence", "judgement: bounds files; a sum takes the least evidence for what is missing", "";
    /// Causes of a single robot that its group does not have, at most.
    ALONE: usize = 3, "causes", "judgement: bounds time", "";
    /// By how much ln of the odds of a rival must be larger to take the place of a cause.
    EXCHANGED: f64 = 1.0, "ln of odds", "judgement: no exchange to and fro", "";
}
