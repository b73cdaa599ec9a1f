//! Names against free forms: lengths, prices, when a name falls.

use super::CriterionValue;
use super::table::criteria;

criteria! {
    "open_world";
    /// Prior variances below this share of the largest.
    NEGLIGIBLE: f64 = 1e-3, "share", "judgement: bounds time", "";
    /// Groups of a place at most.
    GROUPS: usize = 4, "groups", "judgement: bounds time", "";
    /// ln of the evidence by which a further group must pay for itself, beyond the price of its choice.
    PAYS: f64 = 1.0, "ln of evidence", "literature: barely worth a mention, Jeffreys (1961)", "changes nothing on 2";
    /// ln of the evidence by which jumps and corners must be better than a smooth curve.
    JUMPS: f64 = 10.0, "ln of evidence", "literature: twice very strong, Kass and Raftery (1995)", "";
    /// How often the number of a group's variable is halved in its step.
    LEVELS: i32 = 4, "levels", "judgement: bounds time", "";
    /// Groups whose shorter lengths are looked at.
    CLOSER: usize = 10, "groups", "judgement: bounds time", "";
    /// Correlation lengths of smooth functions, shares of their variable's range.
    LENGTHS: [f64; 5] = [1.0, 0.35, 0.12, 0.045, 0.02], "share of the range", "count: threefold from the whole range to what cosines resolve", "changes nothing on 2";
    /// Cosines of the turn of a joint over its own angle, as gears make it.
    FINEST: usize = 48, "cosines", "count: orders of a gear per turn", "";
    /// Cosines over a motion's own angle and over time.
    FINE: usize = 16, "cosines", "judgement: bounds time", "";
    /// Cosines over any other variable.
    COARSE: usize = 8, "cosines", "judgement: bounds time", "";
    /// Cosines over a variable that is tried with several numbers; the best of these is looked at again with [`FINE`] ones.
    SKETCH: usize = 4, "cosines", "judgement: bounds time", "";
    /// Cosines of each of two variables.
    EACH: usize = 4, "cosines", "judgement: bounds time", "";
    /// Cosines by which one of two variables is told from the other.
    TOLD_BY: usize = 6, "cosines", "judgement: bounds time", "";
    /// The share of its variance above which one variable follows the other: then it shows no product of both.
    TOLD: f64 = 0.7, "share of the variance", "judgement: half of what one variable says is its own", "changes nothing on 2";
    /// Cosines have no slope at the ends of their range: it is wider than the rows' by this share at either end.
    MARGIN: f64 = 0.1, "share of the range", "judgement: a slope at the end of the rows stays possible", "changes nothing on 2";
    /// A variable of no more values than this is a number of its own, not a range.
    NUMBERS: usize = 3, "values", "count: three values bear no curve", "";
    /// Places of a knot that are tried.
    KNOTS: usize = 48, "places", "judgement: bounds time; the best are refined", "";
    /// Places around a knot that are tried in the end.
    CLOSER_KNOTS: usize = 8, "places", "judgement: bounds time", "";
    /// Rows between two knots, and beyond the last, for each number that is fitted there.
    BETWEEN_KNOTS: usize = 3, "rows a number", "judgement: one wrong row makes no jump", "";
    /// Steps in time that are tried.
    STEPS: usize = 40, "steps", "judgement: bounds time; the best is refined", "";
    /// Limits at which what sticks slips.
    LIMITS: [f64; 3] = [0.07, 0.14, 0.28], "share of the range", "count: twofold", "";
    /// Times in which a travel fades.
    FADING: [f64; 3] = [15.0, 35.0, 80.0], "s", "judgement: between two readings and some minutes", "";
    /// ln of the evidence of a free form beside everything, over the number of places, above which it joins; and by which one
    /// is better than all causes together where it stands in their place.
    STRONG: f64 = 3.0, "ln of evidence", "literature: strong, Jeffreys (1961)", "changes nothing on 1";
    /// The same of the first free form of a model: false ones are of a few micrometres.
    FIRST: f64 = 6.0, "ln of evidence", "count: of 150 recordings that conceal nothing 3 had one by 3, and 2 by 6", "";
    /// ln of what each cause's size costs beside a known one.
    SIZE: f64 = 3.0, "ln of evidence", "judgement: a size is one of some twenty on the grid", "changes nothing on 1";
    /// What goes may cost this share of the folds' rms.
    WORSE: f64 = 0.01, "share of the rms", "judgement: what a user would not notice", "";
    /// A noise that is larger than stated by less than this share, in squares, is the stated one.
    LOUDER: f64 = 1.05, "ratio of squares", "judgement: the scatter of a variance of a thousand values", "changes nothing on 2";
    /// Prior odds that nothing is there.
    NOTHING: f64 = 0.5, "probability", "literature: indifference", "changes nothing on 2";
    /// Rivals whose evidence is asked.
    RIVALS: usize = 12, "causes", "judgement: bounds time", "";
    /// A law of the list is never quite the true one: what a free form at its own place adds is its finer shape below this
    /// share of both.
    FINER: f64 = 0.1, "share", "judgement: arms and twin differ from the library by less", "";
    /// ln of the evidence by which a free form must be better than a name with a free form beside it, to stand in its place.
    CLEARLY: f64 = 3.0, "ln of evidence", "literature: strong, Jeffreys (1961)", "";
    /// That evidence misleads: its groups, priors and noise are a model, too, in which no odds are better than the share of
    /// names that were wrong where it was sure of them.
    MISLED: f64 = 0.02, "probability", "count: wrong names among sure ones of concealed recordings", "changes nothing on 2";
    /// That a law without a name acts at its place where it is the only one, beside what evidence says of it.
    PLACED: f64 = 0.93, "probability", "measured by tests/reference/calibrate_probability.py", "";
    /// The same where several laws without a name share the error: one effect may be split over places that are not its own.
    PLACED_AMONG: f64 = 0.64, "probability", "measured by tests/reference/calibrate_probability.py", "";
    /// How often a cause that is in no list is called by a name of the list that evidence is sure of, over how often one of the list is.
    MIMICRY: f64 = 0.2, "ratio", "count: 32 of 164 concealed causes of L 50 or more; tests/reference/calibrate_probability.py finds 0.05, hardly better", "";
    /// The same of several names that take up loads.
    MIMICRY_OF_LOADS: f64 = 20.0, "ratio", "measured by tests/reference/calibrate_probability.py", "";
    /// What the criterion must lose without a name that stands beside a free form.
    SEEN: f64 = 10.0, "-2 ln of odds", "literature: very strong, Kass and Raftery (1995)", "";
    /// What a name that stands beside a free form must have of the evidence of all names there.
    SHARED: f64 = 0.1, "share", "judgement: a name of ten is none", "";
    /// Places at which a free form is asked with more than one group.
    PLACES: usize = 2, "places", "judgement: bounds time", "";
    /// Functions of each variable that are looked at.
    LOOKED_AT: usize = 3, "functions", "judgement: bounds time", "";
    /// Products of a motion that become groups.
    PICKED: usize = 6, "groups", "judgement: bounds time", "";
    /// Mean square of what is left, over that of noise, below which nothing is looked for.
    STRUCTURED: f64 = 1.1, "ratio of squares", "judgement: the scatter of a variance of some hundred values, doubled", "changes nothing on 2";
    /// Changes of a model at most.
    ROUNDS: usize = 8, "rounds", "judgement: bounds time", "";
}
