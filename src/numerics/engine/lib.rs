//! One search for the physics that a model leaves out, whatever was recorded.
//!
//! A [`Problem`] says which [`Cell`]s there are, what each would do to the rows around the present fit (a [`Block`] of columns by its products),
//! and fits a set of them with everything that is not linear in it. [`diagnose`] adds, exchanges and drops cells by one price, the evidence,
//! and says of each cell that stands which others could stand in its place. No cause is known here by its name.
//!
//! The formula of the evidence is one, too: [`evidence`] of columns by their products, whatever they are columns of.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use std::borrow::Cow;

mod evidence;
pub mod linear;
mod rows;
mod search;

pub use evidence::{
    AMPLITUDES, EvidenceRows, GroupEvidence, evidence, evidence_at, evidence_between, log_sum,
    log_sums,
};
pub use rows::{Block, Rows, ranked};
pub use search::{Answer, Options, diagnose, dropped, findings};

/// A cause: a row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// In tables and JSON; a user's own causes have names of their own.
    pub name: Cow<'static, str>,
    /// The kind of variable that it follows: own speed, load, time ..; empty where each cell has its own.
    pub follows: &'static str,
    /// What it does at a place `{}`, for a person.
    pub sentence: &'static str,
    /// Its numbers.
    pub numbers: &'static [Number],
    /// ln of the prior odds that it is there, of all its places together.
    pub log_prior: f64,
}

impl Cause {
    /// One of which a problem says all but the name itself.
    pub const fn named(name: Cow<'static, str>) -> Self {
        Self {
            name,
            follows: "",
            sentence: "",
            numbers: &[],
            log_prior: 0.0,
        }
    }
}

/// A number of a cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Whether it is fitted as its logarithm.
    pub by_logarithm: bool,
}

/// What may be missing: a cause at a place, whatever its size and shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell<K> {
    /// What the problem knows it by.
    pub key: K,
    /// Its cause.
    pub cause: Cause,
    /// Where it acts, in words: `joint 2`.
    pub place: String,
    /// ln of its prior odds.
    pub log_prior: f64,
    /// How it may look.
    pub shapes: Vec<Shape>,
    /// Cells that it modifies, and without which it is nothing.
    pub needs: Vec<K>,
}

/// A shape of a cell: where its numbers begin, and how far they usually are from there.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Numbers at which a fit begins, as they are fitted.
    pub start: Vec<f64>,
    /// One standard deviation of each about `centre`; 0 holds it.
    pub usual: Vec<f64>,
    /// Where they are expected.
    pub centre: Vec<f64>,
    /// Between which each may be, as it is fitted.
    pub bounds: Vec<[f64; 2]>,
    /// Numbers of which the columns of a scan are the whole effects.
    pub columns: Vec<Vec<f64>>,
    /// ln of its share of the cell.
    pub log_weight: f64,
}

/// A cell that stands in a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Accepted<K> {
    /// Which.
    pub cell: Cell<K>,
    /// Which of its shapes.
    pub shape: usize,
    /// Its numbers as they are fitted.
    pub numbers: Vec<f64>,
}

/// A cell as a scan saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scanned<K> {
    /// With the shape and the numbers from which a fit begins.
    pub accepted: Accepted<K>,
    /// ln of its posterior odds against nothing, by the linear model.
    pub log_odds: f64,
}

/// Another name for a finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Rival<K> {
    /// What it would be, as fitted in the finding's place.
    pub accepted: Accepted<K>,
    /// Probability of it.
    pub probability: f64,
    /// ln of its odds against the finding.
    pub log_odds: f64,
}

/// A cell that stands, with what else could.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding<K> {
    /// What stands.
    pub accepted: Accepted<K>,
    /// Probability of its name at its place.
    pub probability: f64,
    /// Probability of its place, whatever the name.
    pub place_probability: f64,
    /// Probability that nothing is there.
    pub none_probability: f64,
    /// ln of the odds of the model with it against that without.
    pub log_odds: f64,
    /// What else it may be, likeliest first.
    pub rivals: Vec<Rival<K>>,
}

/// What was recorded, and how a model of it is fitted. Where a fit is linear in all but which cells are in it, and rows are independent, what has
/// an answer here already holds.
pub trait Problem: Sync {
    /// What it knows cells by.
    type Key: Clone + PartialEq + Send + Sync;
    /// A fitted model.
    type Fit: Clone + Send + Sync;
    /// What every cell of the table, and every member of a set, does around a fit.
    type Around: Send + Sync;

    /// The cells of the table linearised around a fit; columns of an earlier linearisation that still hold may be reused.
    fn around(&self, fit: &Self::Fit, before: Option<&Self::Around>) -> Self::Around;
    /// The fit with its number of effective rows, estimated from the linearisation around it.
    fn informed(&self, fit: Self::Fit, _around: &Self::Around) -> Self::Fit {
        fit
    }
    /// Cells by their evidence around a fit, those of no use left out; member `out` of its set is left out to first order. Likeliest first.
    fn scan(
        &self,
        fit: &Self::Fit,
        around: &Self::Around,
        out: Option<usize>,
    ) -> Vec<Scanned<Self::Key>>;
    /// Everything fitted at once, from the numbers of the set and the fit before; it may stop where the evidence cannot reach `least`, and what
    /// comes out as it cannot be is in the set no more.
    fn fit(&self, set: &[Accepted<Self::Key>], before: Option<&Self::Fit>, least: f64)
    -> Self::Fit;
    /// The same with every derivative made anew, to the end: a trial among many may reuse those of the fit before.
    fn settled(&self, fit: &Self::Fit) -> Self::Fit {
        fit.clone()
    }
    /// Whether a fit is computed as accurately (by steps as short) as what was found asks for; where it is not, a search ends before it asks what
    /// else each cell could be.
    fn is_accurate(&self, _fit: &Self::Fit) -> bool {
        true
    }
    /// The set with its numbers as fitted.
    fn set(&self, fit: &Self::Fit) -> Vec<Accepted<Self::Key>>;
    /// How far noise is from independent around a fit: effective rows a row.
    fn independence(&self, _fit: &Self::Fit) -> f64 {
        1.0
    }
    /// ln of the evidence of a fit, priors of its cells included, where so large a share of the rows is independent.
    fn log_evidence(&self, fit: &Self::Fit, independence: f64) -> f64;
    /// ln of the odds of a member of the set against nothing, to first order; `None` where only a fit without it tells.
    fn odds(&self, _fit: &Self::Fit, _member: usize, _independence: f64) -> Option<f64> {
        None
    }
    /// Whether two cells are one for the question what else could stand: both have one name at one place.
    fn is_same(&self, one: &Accepted<Self::Key>, other: &Accepted<Self::Key>) -> bool {
        one.cell.cause.name == other.cell.cause.name && one.cell.place == other.cell.place
    }
    /// Whether two cells in their shapes exclude each other: both change the same term of the model.
    fn excludes(&self, _one: &Accepted<Self::Key>, _other: &Accepted<Self::Key>) -> bool {
        false
    }
}
