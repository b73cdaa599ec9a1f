//! What one round hands to the next: columns are derivatives around a model, and a model that was fitted anew has nearly the same.
//!
//! Effects are small, so that the directions in which they move a point change by thousandths from round to round; what is left changes
//! much, and is looked at anew. What is chosen is fitted in the whole model.

use crate::criteria::search::SAME;
use crate::diagnose::whitened::WhitenedProblem;
use crate::effect::{Form, Hypothesis};
use faer::Mat;
use std::collections::HashMap;

/// The list of a round with its columns.
pub(crate) struct EarlierPool {
    pub(super) rows: Vec<usize>,
    /// Compliance of each joint, rad/Nm.
    pub(super) compliance: Vec<f64>,
    pub(super) columns: ListedColumns,
    /// As [`super::CachedHypotheses`] has them.
    pub(super) across: HashMap<usize, Vec<f64>>,
    pub(super) known: Vec<KnownForm>,
}

/// Hypotheses of a list, and their columns beside the base model.
pub(super) struct ListedColumns {
    pub hypotheses: Vec<Hypothesis>,
    pub base: Mat<f64>,
    pub columns: Vec<f64>,
    pub scale: Vec<f64>,
    pub first: Vec<usize>,
    pub gram: Vec<Vec<f64>>,
}

/// A form beyond the list: its columns with their raw lengths, and their products with the columns of the list.
pub(super) struct KnownForm {
    pub form: Form,
    pub columns: (Vec<f64>, Vec<f64>),
    pub products: Vec<f64>,
}

impl EarlierPool {
    /// Whether it may stand for the pool of another round: the same rows, no currents, whose weight is that of a residual, and joints that
    /// yield as before.
    pub fn serves(&self, problem: &WhitenedProblem, compliance: &[f64]) -> bool {
        let same = |(now, before): (&f64, &f64)| (now - before).abs() <= *SAME * before.abs();
        let readings_alone = problem.residual_rows() == problem.of_readings().len();
        readings_alone && self.rows == problem.rows && compliance.iter().zip(&self.compliance).all(same)
    }
}
