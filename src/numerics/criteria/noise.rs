//! What is noise: repeats, stated sigma, autocorrelation, sizes that causes share.

use super::criterion::{CriterionValue, criteria};

criteria! {
    "noise";
    /// A residual that is larger than the noise by this factor, in mean square, does not agree with it: where it has structure it is
    /// not explained.
    MAX_CHI_SQUARE_OF_STRUCTURE: f64 = 1.25, "ratio of squares", "judgement: more than a stated sigma is off by", "changes nothing on 2";
    /// A residual that is larger than the noise by this factor, in mean square, is not explained, whatever it looks like.
    MAX_CHI_SQUARE: f64 = 2.5, "ratio of squares", "judgement: no stated sigma is off by 60 %", "changes nothing on 2";
    /// Repeats that make the noise known; with fewer it is taken from a residual without structure.
    REPEATS: usize = 10, "repeats", "count: a standard deviation known to a quarter", "";
    /// Fewer repeats than this say too little.
    FEW: usize = 4, "repeats", "count: a standard deviation known to a third", "";
    /// A squared whitened error counts at most this much.
    CAP: f64 = 30.0, "squared standard deviations", "count: five and a half, beyond any normal row", "";
    /// The median of the squared length of three normal numbers: repeats by their usual one, which mistakes among them do not move.
    MEDIAN: f64 = 2.366, "squared standard deviations", "count: chi-square with three degrees of freedom", "";
    /// Rows beyond this tell the search nothing new about which cause it is, and cost it time.
    SEARCHED: usize = 800, "rows", "judgement: bounds time", "";
    /// Rows that count as fewer than this are independent.
    ALONE: f64 = 1.2, "rows", "judgement: a sixth of correlation is none", "changes nothing on 2";
    /// With fewer stretches than this signs by stretch say nothing.
    STRETCHES: usize = 40, "stretches", "count: a bootstrap by signs needs tens of units", "";
    /// The criterion must be better by this much for another belief: strong evidence (Kass and Raftery, 1995), doubled.
    PLAIN: f64 = 20.0, "-2 ln of odds", "literature: strong evidence, doubled, Kass and Raftery (1995)", "changes nothing on 2";
    /// By how much another belief about the noise must be better.
    CLEARER: f64 = 8.0, "-2 ln of odds", "literature: strong evidence, Kass and Raftery (1995)", "";
    /// Of autocorrelations whose criterion is within this of the best the longest is taken (95 % of chi-square with one degree
    /// of freedom): too short a noise makes causes of noise.
    AS_GOOD: f64 = 3.84, "-2 ln of likelihood", "literature: 95 % of chi-square, one degree of freedom", "";
    /// Sizes are asked anew after each fit with priors, so often at most.
    FITS: usize = 2, "fits", "judgement: bounds time", "";
    /// Twice the logarithm of the evidence, below the greatest, at which a size is spoken against.
    AGAINST: f64 = 6.0, "-2 ln of evidence", "literature: positive evidence, Kass and Raftery (1995)", "";
    /// A combination this many times (squared) its standard error is shown by the rows.
    SHOWN: f64 = 9.0, "squared standard errors", "literature: three sigma", "";
    /// A coefficient is hardly ever smaller than this share of the largest that is not of the family: the arm's own lines bend
    /// a little.
    LEAST_SHARE: f64 = 0.2, "share", "judgement: lines of an arm", "";
    /// The autocorrelation is estimated at most so often: what it makes of slow causes changes what it is estimated from.
    ESTIMATES: usize = 3, "estimates", "judgement: bounds time", "";
    /// A repeatability that changes by less than this share is settled.
    SETTLED: f64 = 0.25, "share", "judgement: weights hardly change by less", "";
    /// Rows follow a path where the middle step from row to row is below this share of the middle distance of any two poses.
    NEAR: f64 = 0.35, "share", "judgement: paths have a hundredth, poses at random one", "";
    /// Residuals of so many standard deviations count as gross: they would hide what the others share.
    GROSS: f64 = 5.0, "standard deviations", "literature: one normal value in two million", "";
    /// No current says more than this share of the joint's largest torque: motor constants and friction are no better known.
    CURRENTS: f64 = 5e-3, "share of the largest torque", "judgement: motor constants and friction", "";
}
