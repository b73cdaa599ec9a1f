//! What is known of a parameter before the recording speaks: a normal prior, bounds, or both.

/// Beforehand about one parameter, SI.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Known {
    /// A normal distribution, if any.
    pub prior: Option<Prior>,
    /// A range, if any.
    pub bounds: Option<Bounds>,
}

/// A normal distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// SI.
    pub mean: f64,
    /// Above zero.
    pub sigma: f64,
}

/// Both ends belong to what is allowed; `low < high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// SI.
    pub low: f64,
    /// SI.
    pub high: f64,
}

/// A distance between two sockets, planes, spheres (their centres) or ends of distances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownLength {
    /// By their numbers in the robot's setup, two different ones.
    pub between: [usize; 2],
    /// m
    pub length: f64,
    /// m, above zero.
    pub sigma: f64,
}

/// What a prior and the data say of one parameter, after a fit with both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PriorCheck {
    /// As it was stated.
    pub prior: Prior,
    /// Estimate and standard deviation without this prior, SI; `None` where the data alone say nothing.
    pub without: Option<(f64, f64)>,
    /// Distance of the two in standard deviations of their difference.
    pub conflict: f64,
}

/// A prior and data farther apart than this many standard deviations contradict each other.
pub const CONFLICT: f64 = 3.0;

impl PriorCheck {
    /// From the estimate and its variance with the prior: the prior's information taken off again.
    pub(crate) fn of(prior: Prior, estimate: f64, variance: f64) -> Self {
        let (prior_variance, off) = (prior.sigma * prior.sigma, estimate - prior.mean);
        let gained = prior_variance - variance;
        // The data's share of the information is rest / own: smaller, it is rounding.
        if gained <= 1e-6 * prior_variance {
            return Self {
                prior,
                without: None,
                conflict: 0.0,
            };
        }
        let without = (
            prior.mean + off * prior_variance / gained,
            (variance * prior_variance / gained).sqrt(),
        );
        Self {
            prior,
            without: Some(without),
            conflict: off.abs() / gained.sqrt(),
        }
    }
}
