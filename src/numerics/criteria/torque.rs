//! Torques of moving arms: what a recording is refused for, and what of its laws is named.

use super::criterion::{CriterionValue, criteria};

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
    /// Blocks in time of the fitted rows, each predicted by the others.
    BLOCKS: usize = 5, "blocks", "count: without them errors of a UR10 are 0.145 for 0.104", "";
    /// By how much each column of a cause without a name must lower the whitened squared error of the blocks.
    CONFIRMED: f64 = 3.0, "square", "judgement: a number that explains nothing loses one", "";
    /// How near (logarithm) a shape number is to an end of its search to be none.
    AT_END: f64 = 0.02, "logarithm", "count: the finest grid has steps of 0.003, the one before of 0.01", "";
    /// Greatest torque of one law of friction, one standard deviation beforehand, over half the range of its joint's torque.
    FRICTION: f64 = 1.0, "share", "physics: no law of friction alone is more than the whole torque", "";
    /// What a cause and nothing, or hypotheses about masses and about drives, must differ by to exclude each other: twice the logarithm of their
    /// odds.
    APART: f64 = 8.0, "-2 ln likelihood", "judgement: odds of 50 to 1", "";
    /// Share of half the range of a joint's torque that counts in the evidence as much as a metre of motion at the tool.
    PER_METRE: f64 = 100.0, "1/m", "judgement: amplitudes from a ten-thousandth of half the range to three times it", "";
    /// Least variance of the noise over what the rich model leaves.
    LEAST_NOISE: f64 = 0.09, "ratio of variances", "judgement: as of points", "";
    /// Amplitude at which a cause begins, before it is found from the rows.
    USUAL: f64 = 1e-3, "m", "judgement: a tenth of half the range of a joint's torque", "";
    /// Causes of a model at most.
    COMPONENTS: usize = 60, "causes", "judgement: bounds time; two frictions a joint are among them", "";
    /// Exchanges of a search at most.
    EXCHANGES: usize = 12, "exchanges", "judgement: bounds time", "";
    /// Rows before that noise remembers, at most, where it is what the rich model leaves, whose slow part went with what is slow in that model,
    /// and where it is what a set leaves.
    MEMORY: [usize; 2] = [4, 12], "judged rows", "count: noise that lasts a fifth of a second has 0.71 of its density at rest by 4 rows, 0.98 by 12", "";
    /// Times an upper bound of the scatter of least squares by which a fit by correlated noise must leave more than they do to be misled by it.
    MISLED: f64 = 0.25, "ratio", "count: right models of twins leave less than 0.15, a servo in a loop of its encoder's counts 0.3 to 5", "";
    /// What a shape number that is not the usual one must gain beyond the logarithm of the number of rows.
    UNUSUAL: f64 = 4.0, "square", "literature: 95 % of one number", "";
    /// A gain that is worth a new shape or another step.
    BETTER: f64 = 0.05, "square", "judgement: nothing that rows could show", "";
    /// Time over which the squared residual is averaged to look for a push.
    PUSH_AVERAGED: f64 = 0.8, "s", "physics: arms are pushed for about a second", "";
    /// Pushes of a recording, at most.
    PUSHES: usize = 4, "pushes", "judgement: bounds time", "";
    /// Power of the torque that the positions of declared masses ask for over that of the recorded one, at a frequency, from which on the positions
    /// are counts of an encoder.
    BEYOND: f64 = 2.0, "ratio", "judgement: declared inertias are not 1.4 times the true ones", "";
    /// Power of a torque over what it is where the positions are counts of an encoder, up to which it is the arm's.
    STANDS: f64 = 4.0, "ratio", "judgement: twice the size", "";
    /// Median absolute deviations above the median at which a time is looked at.
    PUSH_DEVIATIONS: f64 = 6.0, "deviations", "judgement: four standard deviations", "";
    /// The same, times the median.
    PUSH_TIMES_USUAL: f64 = 1.7, "ratio", "judgement: no noise is as uneven over a second", "";
    /// Judged rows of a push, at least.
    PUSH_FEWEST: usize = 4, "rows", "count: three components of a force and one more", "";
    /// Time on either side of a push in which no other is looked for.
    PUSH_APART: f64 = 1.6, "s", "judgement: twice the time of averaging", "";
    /// What the force of a push must gain.
    PUSH_GAIN: f64 = 100.0, "square", "judgement: seven standard deviations for each of three components, as some hundred times are looked at", "";
    /// Share that it must explain of what stands above the noise.
    PUSH_SHARE: f64 = 0.6, "share", "judgement: more than half", "";
    /// Share of the gain that is not of one joint: what only one joint feels is no force at the tool.
    PUSH_OTHERS: f64 = 0.001, "share", "physics: levers differ by less than thirty, squares by less than a thousand", "";
    /// That gain itself, at least.
    PUSH_OTHERS_GAIN: f64 = 25.0, "square", "judgement: five standard deviations", "";
    /// Share of the rows in which the arm must move: at rest a slow change of torque is stiction.
    PUSH_MOVING: f64 = 0.3, "share", "judgement: a third", "";
}
