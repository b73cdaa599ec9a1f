//! The table of causes: prior odds of its cells, shapes of their curves, when a search ends.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "cells";
    /// Prior odds of a cell of causes that most arms have.
    COMMON: f64 = 0.02, "odds", "judgement: some of ten common kinds in each arm", "";
    /// The same of causes that few arms have.
    RARE: f64 = 0.005, "odds", "judgement: a quarter of the common ones", "";
    /// The same of causes that hardly any arm has.
    RARER: f64 = 0.002, "odds", "judgement: a tenth of the common ones", "";
    /// Prior odds of all cells without a name at a place together.
    UNNAMED: f64 = 0.003, "odds", "judgement: a sixth of a common cause at each place", "";
    /// Rows with fewer than which cells without a name are asked only where the others leave more than noise: a free curve bends what geometry
    /// leaves open.
    OPEN: usize = 60, "rows", "count: twice the numbers of an arm's geometry, in rows of three", "";
    /// Probability of a cause in no list for which these odds are.
    USUAL: f64 = 0.3, "probability", "judgement: the default of the setting `open_world`", "";
    /// Probability of a cause, by other robots of the model, above which it counts as no more usual.
    USUAL_MOST: f64 = 0.9, "probability", "judgement: a recording has to show something of a cause", "";
    /// Prior odds of a product without a name, where one of its variables already shows there.
    PRODUCT: f64 = 0.0007, "odds", "judgement: less than a rare cause", "";
    /// Prior odds of a product without a name of which neither variable shows by itself.
    PAIR: f64 = 1e-5, "odds", "count: the odds of a place over its thousand pairs", "";
    /// Cosine of the angle between two directions in space above which they are one variable.
    ONE_DIRECTION: f64 = 0.95, "cosine", "judgement: less than a third of the angle between those that are asked", "";
    /// Ratio of what a search leaves to the stated noise above which all pairs of variables are looked at.
    UNEXPLAINED: f64 = 1.25, "ratio", "judgement: no stated noise is off by more as a rule", "";
    /// Products, of all pairs of variables, that become cells.
    PAIRS: usize = 24, "cells", "judgement: bounds time", "";
    /// Degrees of freedom that the stated noise is worth.
    NU: f64 = 20.0, "rows", "judgement: a statement is as good as twenty rows", "";
    /// Smallest amplitude, rms motion of the tool: below it no instrument sees anything.
    SMALLEST: f64 = 1e-6, "m", "physics: a tenth of a tracker's noise", "";
    /// Largest amplitude: above it is a wrong set-up.
    LARGEST: f64 = 3e-2, "m", "physics: a soft arm under its payload yields by millimetres", "";
    /// ln of the posterior odds above which a cell joins the model.
    JOINS: f64 = 3.0, "ln of odds", "literature: strong, Jeffreys (1961)", "";
    /// ln of the posterior odds below which a cell of the model leaves it.
    LEAVES: f64 = 2.0, "ln of odds", "judgement: a little below the odds by which it joined", "";
    /// By how much ln of the posterior odds has to be larger for another cell to take the place of one.
    SWAPS: f64 = 0.1, "ln of odds", "judgement: no exchange to and fro", "";
    /// ln of the evidence by which a shape with further numbers must be better than a plain one.
    BENDS: f64 = 6.0, "ln of evidence", "judgement: a load that is off by some percent bends a straight spring by up to that", "";
    /// That the evidence misleads: true shapes, places and noise differ a little from every cell's.
    MISLED: f64 = 0.03, "probability", "judgement: until it is measured on concealed recordings", "";
    /// Share of the probability of a name that another cause has which does the same in whatever data.
    IDENTITY: f64 = 0.1, "probability", "judgement: the one that was asked first is the usual one", "";
    /// Probability from which another name is told as a rival.
    RIVAL: f64 = 0.02, "probability", "judgement: less would not change what one does", "";
    /// Share of the strongest finding at its place below which what has no name is a detail of it.
    DETAIL: f64 = 0.05, "share", "physics: no law is met to a twentieth", "";
    /// Probability that nothing more is there from which what is left is taken for noise.
    SETTLED: f64 = 0.3, "probability", "judgement: no cell that would have joined", "";
    /// Share of the strongest finding anywhere below which what has no name is a detail of that.
    TRACE: f64 = 0.015, "share", "physics: no law is met to a hundredth", "";
    /// Share of the ln of evidence of the strongest finding below which what has no name is a detail of that.
    FAINT: f64 = 0.015, "share", "count: a shape that is met to an eighth of its size leaves a sixty-fourth of its square", "";
    /// What a motion leaves of the second order: this times its square.
    SECOND_ORDER: f64 = 0.5, "1/m", "physics: half of the square of a motion over the reach of an arm, a metre", "";
    /// Components of a model at most.
    COMPONENTS: usize = 26, "components", "judgement: bounds time", "";
    /// Cells of which every shape is asked, after all were asked coarsely.
    CLOSELY: usize = 12, "cells", "judgement: bounds time", "";
    /// Rounds of fitting the whole model and searching around it.
    ROUNDS: usize = 5, "rounds", "count: two suffice as a rule, a further one for each size of effects", "";
    /// Correlation lengths of curves, shares of the range of their variable.
    LENGTHS: [f64; 5] = [1.0, 0.35, 0.12, 0.045, 0.015], "share of the range", "count: threefold, from the whole range to what forty cosines resolve", "";
    /// Share of a curve in a line that is not quite straight, rms over rms.
    BENT: [f64; 2] = [0.05, 0.3], "ratio", "physics: stiffnesses change by 5 to 50 % over a load", "";
    /// Cosines have no slope at the ends of their range: it is wider than that of the rows by this share at either end.
    MARGIN: f64 = 0.1, "share of the range", "judgement: a slope at the end of the rows stays possible", "";
    /// A coefficient whose motion, at its prior standard deviation, is below this share of the noise over all rows is left out.
    IDLE: f64 = 0.2, "standard deviations", "judgement: nothing that the rows could show", "";
    /// Residuals beyond this many standard deviations count for less.
    FAR: f64 = 4.0, "standard deviations", "count: one in a thousand rows of normal noise", "";
    /// Ratio of the largest to the smallest variance of the noise by direction above which its shape is estimated.
    UNEVEN: f64 = 1.8, "ratio of variances", "count: the scatter of variances of a hundred rows", "";
    /// Rows of even noise that a shape of the noise has to speak against.
    EVEN: f64 = 10.0, "rows", "judgement: a shape by few rows is scatter", "";
    /// Sum of the eigenvalues of a^2 X'X beyond which rounding decides on the smallest of them: no evidence there.
    EXACT: f64 = 1e12, "ratio", "count: four digits of sixteen are left", "";
    /// Functions of each of two variables where products are looked at for the first time.
    ROUGHLY: usize = 4, "functions", "judgement: bounds time", "";
    /// Functions of each of two variables in a product, of motions in one direction, in two, in three.
    EACH: [usize; 3] = [6, 5, 4], "functions", "judgement: bounds time", "";
    /// Products of a scan that are looked at as one curve times another.
    SEPARATED: usize = 3, "cells", "judgement: bounds time", "";
    /// Turns of estimating one of the two curves of a product given the other, at most.
    TURNS: usize = 8, "turns", "judgement: bounds time", "";
    /// Gain of a turn, ln of the evidence, below which it is the last.
    TURNED: f64 = 0.1, "ln of evidence", "judgement: no odds that matter change by it", "";
    /// Functions of the curve of a product that stays free in the end.
    JUMPING: usize = 40, "functions", "count: a jump within a fortieth of the range", "";
    /// Cosines of a curve that is looked at once more.
    FINELY: usize = 24, "cosines", "count: bends over a twenty-fourth of the range", "";
    /// Values of a variable at which a curve is asked for a step.
    THRESHOLDS: usize = 48, "values", "judgement: bounds time; a step is met to a fiftieth of the rows", "";
    /// Cosines of what is not straight in a law that is nearly a line.
    BENDING: usize = 12, "cosines", "count: bends over a twelfth of the range", "";
    /// Steps in time of a motion without a name that are asked at first.
    STEPS: usize = 24, "steps", "judgement: bounds time; the best cells are asked at every time", "";
    /// A variable of no more values than this bears no curve.
    FEW: usize = 3, "values", "count: three values", "";
    /// Limits at which what sticks beside a joint slips.
    LIMITS: [f64; 4] = [0.06, 0.12, 0.24, 0.48], "share of the joint's travel", "count: twofold, up to half of it", "";
    /// The same at most: what sticks over more of the travel is the joint's angle.
    STICKS: f64 = 0.5, "share of the joint's travel", "physics: half of it either way is all of it", "";
    /// Share of the rows that may be uncertain by moves before the first: what remembers longer is taken to begin at rest.
    UNRECORDED: f64 = 0.1, "share", "judgement: the others say what it is", "";
    /// Times in which a move fades.
    FADING: [f64; 3] = [15.0, 35.0, 80.0], "s", "judgement: between two readings and some minutes", "";
    /// ln of the odds, below the best, from which a cell is not asked.
    FAR_BELOW: f64 = 12.0, "ln of odds", "count: 1 in 160,000", "";
    /// ln of the odds below which no cell is asked.
    UNLIKELY: f64 = -8.0, "ln of odds", "count: 1 in 3,000", "";
    /// Cells that are asked first when one has joined.
    LIKELY: usize = 240, "cells", "judgement: bounds time; all are asked before the search ends", "";
    /// Cells of a scan that are put in the model to see which says most there.
    TRIED: usize = 4, "cells", "judgement: bounds time; a scan is exact but for what it leaves of the others", "";
    /// Share of a component's motion that a cell must be able to make to be asked in its place.
    ALIKE: f64 = 0.2, "share", "judgement: less explains something else", "";
    /// Share of two components' covariances in common above which one is estimated anew when the other joins.
    COUPLED: f64 = 0.01, "share", "judgement: bounds time", "";
    /// How often a step of a shape's number is halved.
    LEVELS: i32 = 5, "levels", "judgement: bounds time", "";
    /// Share of the evidence of a curve that waves may lack before all sizes are taken anew.
    NEARLY: f64 = 0.2, "share", "judgement: sizes and shapes taken anew gain less", "";
    /// Waves that may stand in for a free curve of a joint's own angle.
    WAVES: usize = 3, "waves", "judgement: gears have few strong orders", "";
}
