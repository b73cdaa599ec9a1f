//! Set-up errors: what is wrong between files and robot file before any physics.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "setup";
    /// A nominal robot leaves less than this share of its reach, and of the size of the measured cloud.
    NOMINAL: f64 = 0.02, "share", "physics: nominal robots err by millimetres in metres", "";
    /// The same of a robot that is set up rightly: what more than one error, or a number, is told by must leave no more of its reach.
    GOOD: f64 = 0.005, "share of the reach", "physics: zeros are off by tenths of a degree, lengths by millimetres in metres", "";
    /// A robot that is set up rightly leaves less than this share of the measured cloud: joints that hardly move agree with
    /// points that hardly move, however wrong both are.
    CLOUD: f64 = 0.1, "share", "judgement: a tenth", "";
    /// A set-up error explains where without it so many times less is left.
    BETTER: f64 = 3.0, "ratio", "judgement: half an order of magnitude", "";
    /// What has numbers of its own must leave so many times less than what has none.
    OWN_NUMBERS: f64 = 2.0, "ratio", "judgement: one number explains less than that", "";
    /// Others that leave no more than so many times as much explain as well.
    ALIKE: f64 = 1.3, "ratio", "judgement: noise of small recordings", "";
    /// Where set-up errors leave no more than so many times the least, and are all but the same by kinematics, the first of
    /// the list counts: a sign is wrong more often than a zero by half a turn.
    SAME: f64 = 1.02, "ratio", "judgement: rounding of fits", "";
    /// Set-up errors that are tried together with another where none explains alone.
    SECOND: usize = 6, "errors", "judgement: bounds time", "";
    /// Points by which countings of all joints are compared before they are placed.
    SCREENED: usize = 60, "rows", "judgement: bounds time", "";
    /// Rows by which all orders of the columns of joints are compared first.
    ORDERED: usize = 24, "rows", "count: fifteen numbers of an affine image and a seat", "";
    /// A zero that is this near to quarter turns is counted from there, whatever it is off by beyond that.
    QUARTERLY: f64 = 5.0, "deg", "physics: zeros are mastered to degrees at worst", "";
    /// Between these the largest angle of an arm's joints lies, in the right unit.
    TURNS: [f64; 2] = [5.0, 720.0], "deg", "physics: arms that are calibrated move, joints turn twice either way at most", "";
    /// Countings that are placed.
    COUNTINGS: usize = 16, "countings", "count: mirror images and turned wrists of one counting, twice", "";
    /// What no arm's length is off by when it is made, as a share of itself.
    LENGTH: f64 = 0.02, "share", "physics: links are made to a tenth of a percent", "";
    /// The same of a short length, as a share of the reach.
    SHORT: f64 = 0.005, "share of the reach", "physics: castings and flanges", "";
    /// The same of a gear's ratio.
    RATIO: f64 = 0.01, "share", "physics: teeth are counted", "";
    /// Standard deviations by which a number must be beyond.
    CLEARLY: f64 = 5.0, "standard deviations", "judgement: models that are wrong elsewhere", "";
    /// A smaller share of all rows than this are strays and no set-up.
    MIXED_SHARE: f64 = 0.1, "share", "judgement: a tenth", "";
    /// Rounds of dealing.
    MIXED_ROUNDS: usize = 12, "rounds", "judgement: it settles in three", "";
    /// Fewer rows than this do not tell one error from another, base and tool alone take nine numbers; and they are strays, no set-up of their own.
    FEWEST: usize = 10, "rows", "count: nine numbers of base and tool", "";
    /// Shifts that are looked at more closely.
    SHIFTS: usize = 3, "shifts", "judgement: bounds time", "";
    /// Larger ones are not tried.
    FARTHEST: usize = 2000, "rows", "judgement: bounds time", "";
    /// Below this many rows, names sorted as text are in order.
    SORTED: usize = 11, "rows", "count: names below 10 sort alike", "";
    /// That it is what it is called: nothing else of the list explains it, or others share it alike.
    NAMED: f64 = 0.98, "probability", "count: set-up errors put in and named, tests/reference/setups.py", "";
    /// Rows farther off than this many medians, and steps so much longer, are wrong by themselves and take no part.
    FAR: f64 = 4.0, "medians", "literature: robust statistics, Huber (1981)", "";
    /// More rows say no more of errors of this size.
    SAMPLE: usize = 240, "rows", "judgement: bounds time", "";
    /// Arms that reach less far, or farther, are not what a robot file in the right unit describes.
    ARMS: [f64; 2] = [0.05, 50.0], "m", "physics: smallest and largest arms", "";
    /// Parts of a displacement below this share of the largest are not stated.
    SMALL: f64 = 0.05, "share", "judgement: a twentieth", "";
}
